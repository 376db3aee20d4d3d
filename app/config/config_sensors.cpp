// SPDX-License-Identifier: Apache-2.0
#include "app/config/config_sensors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "app/config/config_body.h"

namespace tendril::app {
namespace {

constexpr int kLargestIdentifier = 0x7FF, kLargestExtended = 0x1FFF'FFFF;
constexpr Range kFrameRate = {.above = 0, .at_most = 20e3};
constexpr Range kTimeout = {.above = 0, .at_most = 3600};

/// A signal of a sensor before it is known to which lists its parts go.
struct SensorSignal {
  hal::Signal signal;
  MeasuredConfig measured;
};

/// A name as a DBC can have it for a signal.
std::string identifier(std::string name) {
  std::ranges::replace(name, '-', '_');
  return std::isdigit(static_cast<unsigned char>(name[0])) ? "_" + name : name;
}

/// Where the bits of a signal are, and what they mean.
void read_place(Reader& r, hal::Signal& signal, Dimension dimension) {
  r.need("start", signal.start, Range{.at_least = 0, .at_most = 63});
  r.need("length", signal.length, Range{.at_least = 1, .at_most = 64});
  r.may("byte_order", signal.order,
        Words<hal::ByteOrder>{{"intel", hal::ByteOrder::kIntel}, {"motorola", hal::ByteOrder::kMotorola}});
  r.may("type", signal.type,
        Words<hal::SignalType>{{"unsigned", hal::SignalType::kUnsigned},
                               {"signed", hal::SignalType::kSigned},
                               {"float", hal::SignalType::kFloat}});
  r.need("scale", signal.scale, dimension);
  r.may("offset", signal.offset, dimension);
  signal.unit = si_unit(dimension);
}

void check_place(const Value& v, const hal::Signal& signal) {
  if (signal.scale == 0) v.at("scale").fail("a scale other than 0");
  if (signal.type == hal::SignalType::kFloat && signal.length != 32 && signal.length != 64)
    v.at("length").fail("32 or 64 bits, as the type is float");
  if (hal::bytes_needed(signal) > 8)
    v.at("length").fail(
        fmt::format("fewer bits: from bit {} on they reach beyond the 8 bytes of a frame", signal.start));
}

void read_measured_effector(const Value& v, SensorSignal& out, const std::vector<EffectorConfig>& effectors) {
  const auto found = std::ranges::find(effectors, v.text("the name of an effector"), &EffectorConfig::name);
  if (found == effectors.end()) v.fail("the name of an effector");
  if (found->cavity) v.fail("an effector of points, as positions are measured");
  out.measured.effector = static_cast<int>(found - effectors.begin());
}

/// Which actuators have an effort of that name.
bool has(const ActuatorConfig& actuator, std::string_view effort) {
  if (effort == "tension") return std::holds_alternative<CableConfig>(actuator.kind);
  if (effort == "pressure") return actuator.is_cavity();
  return !actuator.is_cavity() && !std::holds_alternative<CableConfig>(actuator.kind);
}

void read_measured_actuator(const Value& v, SensorSignal& out, std::string_view effort,
                            const std::vector<ActuatorConfig>& actuators) {
  const std::string expected = fmt::format("the name of {}", effort == "tension"    ? "a cable"
                                                             : effort == "pressure" ? "a cavity's actuator"
                                                                                    : "a rod or a force");
  const auto found = std::ranges::find(actuators, v.text(expected), &ActuatorConfig::name);
  if (found == actuators.end() || !has(*found, effort)) v.fail(expected);
  out.measured.actuator = static_cast<int>(found - actuators.begin());
  out.signal.name = identifier(fmt::format("{}_{}", found->name, effort));
}

void read_signal(Reader& r, SensorSignal& out, const Config& config) {
  const std::string_view kind = r.one_of({"effector", "tension", "force", "pressure"});
  if (kind == "effector") {
    r.may("effector", out,
          [&](const Value& v, SensorSignal& signal) { read_measured_effector(v, signal, config.effectors); });
    r.need("coordinate", out.measured.axis, Words<int>{{"x", 0}, {"y", 1}, {"z", 2}});
    if (out.measured.effector >= 0)
      out.signal.name =
          identifier(config.effectors[out.measured.effector].name + "_" + "xyz"[out.measured.axis]);
  } else {
    r.may(kind, out, [&](const Value& v, SensorSignal& signal) {
      read_measured_actuator(v, signal, kind, config.actuators);
    });
  }
  read_place(r, out.signal,
             kind == "effector"   ? Dimension::kLength
             : kind == "pressure" ? Dimension::kPressure
                                  : Dimension::kForce);
}

void read_identifier(const Value& v, bool extended, uint32_t& id) {
  int number = 0;
  v.read(number, Range{.at_least = 0, .at_most = kLargestExtended});
  if (!extended && number > kLargestIdentifier)
    v.fail("at most 0x7FF, or extended: true beside it where the identifier has 29 bits");
  id = static_cast<uint32_t>(number);
}

/// Signals share no bit, and the frame is long enough for them.
void check_frame(const Value& v, hal::SensorConfig& frame, bool length_is_given) {
  int needed = frame.age ? hal::bytes_needed(*frame.age) : 1;
  uint64_t taken = frame.age ? hal::bits_of(*frame.age) : 0;
  for (std::size_t k = 0; k < frame.signals.size(); ++k) {
    const uint64_t bits = hal::bits_of(frame.signals[k]);
    if ((taken & bits) != 0)
      v.at("signals").at(k).at("start").fail("bits that no other signal of the frame has, the age included");
    taken |= bits;
    needed = std::max(needed, hal::bytes_needed(frame.signals[k]));
  }
  if (!length_is_given) frame.length = needed;
  if (frame.length < needed)
    v.at("length").fail(fmt::format("at least {} bytes, so far reach the signals", needed));
}

void check_measured_once(const Value& robot, const std::vector<SensorConfig>& sensors) {
  struct Place {
    MeasuredConfig measured;
    std::string path;
  };
  std::vector<Place> known;
  for (std::size_t i = 0; i < sensors.size(); ++i)
    for (std::size_t k = 0; k < sensors[i].measures.size(); ++k) {
      const Value place = robot.at("sensors").at(i).at("signals").at(k);
      const auto twin = std::ranges::find(known, sensors[i].measures[k], &Place::measured);
      if (twin != known.end()) place.fail("what no other signal measures, " + twin->path + " does");
      known.push_back({sensors[i].measures[k], place.path()});
    }
  if (known.size() > hal::kMaxSensorSignals)
    robot.at("sensors").fail(
        fmt::format("at most {} signals in all, these are {}", hal::kMaxSensorSignals, known.size()));
}

}  // namespace

void read_sensor(const Value& v, SensorConfig& sensor, const Config& config) {
  hal::SensorConfig& frame = sensor.frame;
  std::vector<SensorSignal> signals;
  std::optional<int> length;
  v.read(sensor, [&](Reader& r, SensorConfig&) {
    r.need("name", frame.name, read_name);
    r.may("extended", frame.extended);
    r.need("id", frame.id,
           [&frame](const Value& id, uint32_t& out) { read_identifier(id, frame.extended, out); });
    r.may("length", length, Range{.at_least = 1, .at_most = 8});
    r.need("rate", frame.rate_hz, Dimension::kRate, kFrameRate);
    double timeout = 0.1;
    r.may("timeout", timeout, Dimension::kTime, kTimeout);
    frame.timeout_ns = std::llround(1e9 * timeout);
    r.may("on_loss", frame.required, Words<bool>{{"warn", false}, {"stop", true}});
    r.need("signals", signals, [&](const Value& item, SensorSignal& signal) {
      item.read(signal, [&](Reader& section, SensorSignal& out) { read_signal(section, out, config); });
      check_place(item, signal.signal);
    });
    r.may("age", frame.age, [](const Value& item, hal::Signal& age) {
      age.name = "age";
      item.read(age, [](Reader& section, hal::Signal& out) { read_place(section, out, Dimension::kTime); });
      check_place(item, age);
    });
  });
  for (const SensorSignal& signal : signals) {
    frame.signals.push_back(signal.signal);
    sensor.measures.push_back(signal.measured);
  }
  frame.length = length.value_or(0);
  check_frame(v, frame, length.has_value());
  if (frame.timeout_ns < std::llround(2e9 / frame.rate_hz))
    v.at("timeout").fail(fmt::format("at least two frames' time, {:g} s (it is {:g} s)", 2 / frame.rate_hz,
                                     1e-9 * static_cast<double>(frame.timeout_ns)));
}

void check_sensors(const Value& robot, const Config& config) {
  const std::vector<SensorConfig>& sensors = config.sensors;
  if (sensors.size() > hal::kMaxSensors)
    robot.at("sensors").fail(fmt::format("at most {} sensors", hal::kMaxSensors));
  check_measured_once(robot, sensors);
  for (std::size_t i = 0; i < sensors.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (sensors[j].frame.name == sensors[i].frame.name)
        robot.at("sensors").at(i).at("name").fail(
            fmt::format("a name of its own, sensors[{}] has this one", j));
}

}  // namespace tendril::app
