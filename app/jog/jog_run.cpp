#include "app/jog/jog_run.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/config/config.h"
#include "app/config/load_config.h"
#include "app/config/master_config.h"
#include "app/config/quantity.h"
#include "app/jog/jog.h"
#include "app/program/real_time_rights.h"
#include "app/program/stop_signal.h"
#include "app/robot/robot.h"
#include "hal/bus/open_bus.h"
#include "hal/drive/drive_protocol.h"
#include "rt/periodic_clock.h"
#include "rt/spsc_ring.h"
#include "rt/thread.h"

namespace tendril::app {
namespace {

constexpr auto kTick = std::chrono::milliseconds(10);
constexpr double kShown_s = 0.2;

/// One cycle, as the main thread shows it.
struct JogRecord {
  std::int64_t intended_ns = 0;
  Jog::Phase phase = Jog::Phase::kConnecting;
  double commanded = 0, measured = 0;  // m or m³
};
using JogRing = rt::SpscRing<JogRecord, 1024>;

std::size_t index_of(const Config& config, const std::string& name) {
  std::string known;
  for (std::size_t a = 0; a < config.actuators.size(); ++a) {
    if (config.actuators[a].name == name) return a;
    known += (known.empty() ? "" : ", ") + config.actuators[a].name;
  }
  throw ConfigError(fmt::format("{}: has no actuator '{}'; it has {}", config.file.string(), name, known));
}

double parse(const char* option, const std::string& text, Dimension dimension, double otherwise) {
  if (text.empty()) return otherwise;
  double value = 0;
  if (!parse_quantity(text, dimension, std::span(&value, 1)))
    throw ConfigError(
        fmt::format("{}: found '{}', expected {}", option, text, describe_quantity(1, dimension)));
  return value;
}

JogConfig jog_config(const JogOptions& options, const ActuatorConfig& actuator, double period_s) {
  const bool cavity = actuator.is_cavity();
  const Dimension way = cavity ? Dimension::kVolume : Dimension::kLength;
  const hal::DisplacementUnit unit = displacement_unit(actuator);
  JogConfig jog;
  jog.distance = parse("--by", options.by, way, 0);
  jog.speed = parse("--speed", options.speed, cavity ? Dimension::kFlow : Dimension::kSpeed,
                    0.01 * actuator.top_rate);
  jog.lag = parse("--lag", options.lag, way, 1 / unit.per_si);
  jog.least = actuator.displacement_min;
  jog.greatest = actuator.displacement_max;
  jog.period_s = period_s;
  const double limit = parse("--limit", options.limit, way, 5 / unit.per_si);
  if (!(std::abs(jog.distance) <= limit))
    throw ConfigError(
        fmt::format("--by: found {}, expected at most {:g} {} either way; a greater --limit allows "
                    "more",
                    options.by, unit.per_si * limit, unit.name));
  if (!(jog.speed > 0 && jog.speed <= actuator.top_rate))
    throw ConfigError(
        fmt::format("--speed: found {:g} {}/s, expected more than 0 and at most the actuator's top "
                    "rate, {:g} {}/s",
                    unit.per_si * jog.speed, unit.name, unit.per_si * actuator.top_rate, unit.name));
  if (!(jog.lag > 0)) throw ConfigError("--lag: expected more than 0");
  return jog;
}

/// The bus of one axis, with us as its master.
class OneAxis {
 public:
  OneAxis(const Config& config, std::size_t actuator, const std::string& bus)
      : master_(hal::make_master(alone(master_config(config), actuator))),
        bus_(hal::open_bus(bus, hal::BusRole::kJoin, master_->identifiers())) {}

  /// One cycle. Real-time: bounded, no allocation.
  JogRecord cycle(Jog& jog, std::int64_t intended_ns, bool stop) noexcept {
    const int count = bus_->receive(arrived_);
    for (int k = 0; k < count; ++k) master_->receive(arrived_[k], arrived_[k].stamp_ns);
    const std::int64_t now_ns = rt::now_ns();
    const hal::Measurement& measurement = master_->measure(bus_->health(), now_ns);
    frames_.clear();
    master_->command(jog.step(measurement, stop), now_ns, frames_);
    bus_->send(frames_);
    return {intended_ns, jog.phase(), jog.commanded(), measurement.position[0]};
  }

  std::string describe(const hal::DriveFault& fault) const { return master_->describe(fault); }

 private:
  static hal::MasterConfig alone(hal::MasterConfig config, std::size_t actuator) {
    config.axes = {config.axes[actuator]};
    config.axes[0].set_point =
        hal::SetPoint::kDisplacement;  // by hand an axis goes somewhere, whatever it follows
    return config;
  }

  std::unique_ptr<hal::DriveMaster> master_;
  std::unique_ptr<hal::Bus> bus_;
  std::array<hal::Frame, hal::kMaxWaiting> arrived_;
  hal::FrameBatch frames_;
};

const char* name(Jog::Phase phase) {
  constexpr const char* kNames[] = {"connect", "enable", "move", "settle", "disable", "done"};
  return kNames[static_cast<int>(phase)];
}

/// What became of it, in a sentence.
std::string verdict(const Jog& jog, const OneAxis& axis, const ActuatorConfig& actuator, double measured) {
  const hal::DisplacementUnit unit = displacement_unit(actuator);
  switch (jog.ending()) {
    case Jog::Ending::kArrived:
      return fmt::format("'{}' went from {:.3f} to {:.3f} {}, as its drive says", actuator.name,
                         unit.per_si * jog.start(), unit.per_si * measured, unit.name);
    case Jog::Ending::kStopped:
      return fmt::format("stopped at {:.3f} {}", unit.per_si * measured, unit.name);
    case Jog::Ending::kBeyond:
      return fmt::format(
          "'{}' stands at {:.3f} {}, and its limits are {:g} to {:g} {}: it was not moved; is its "
          "reference right?",
          actuator.name, unit.per_si * jog.start(), unit.name, unit.per_si * actuator.displacement_min,
          unit.per_si * actuator.displacement_max, unit.name);
    case Jog::Ending::kStrayed:
      return fmt::format(
          "'{}' was found at {:.3f} {} where {:.3f} {} was commanded, and was disabled: does it "
          "move at all, the right way, and as far as counts and pulley say?",
          actuator.name, unit.per_si * measured, unit.name, unit.per_si * jog.commanded(), unit.name);
    case Jog::Ending::kDriveFault:
      return axis.describe(jog.drive_fault());
  }
  return "";
}

}  // namespace

int run_jog(const JogOptions& options) {
  const Config config = load_config(options.file);
  const std::size_t index = index_of(config, options.actuator);
  const ActuatorConfig& actuator = config.actuators[index];
  Jog jog(jog_config(options, actuator, 1 / config.control.rate_hz));
  lock_memory(options.allow_non_rt);
  const auto axis =
      std::make_unique<OneAxis>(config, index, options.bus.empty() ? config.bus.name : options.bus);
  const auto ring = std::make_unique<JogRing>();
  std::atomic<bool> ended{false};
  rt::RealtimeThread control({"jog", config.control.priority, config.control.cpu},
                             options.allow_non_rt ? rt::RtRights::kIgnore : rt::RtRights::kRequire, [&] {
                               rt::PeriodicClock clock(config.control.rate_hz);
                               while (jog.phase() != Jog::Phase::kDone) {
                                 ring->push(axis->cycle(jog, clock.wait(), stop_signalled()));
                                 clock.realign(rt::now_ns());
                               }
                               ended.store(true, std::memory_order_release);
                             });
  if (!control.refusal().empty()) spdlog::warn("{}", control.refusal());

  const hal::DisplacementUnit unit = displacement_unit(actuator);
  JogRecord record;
  std::int64_t first_ns = 0, shown_ns = 0;
  while (!ended.load(std::memory_order_acquire)) {
    std::this_thread::sleep_for(kTick);
    while (ring->pop(record)) {
      if (first_ns == 0) first_ns = record.intended_ns;
      if (options.json || static_cast<double>(record.intended_ns - shown_ns) < 1e9 * kShown_s) continue;
      shown_ns = record.intended_ns;
      fmt::print("{:6.1f} s  {:8} commanded {:9.3f} {}  measured {:9.3f} {}\n",
                 1e-9 * static_cast<double>(record.intended_ns - first_ns), name(record.phase),
                 unit.per_si * record.commanded, unit.name, unit.per_si * record.measured, unit.name);
      std::fflush(stdout);
    }
  }
  control.join();
  while (ring->pop(record)) {
  }
  const bool arrived = jog.ending() == Jog::Ending::kArrived;
  const std::string text = verdict(jog, *axis, actuator, record.measured);
  if (options.json)
    fmt::print("{}\n", nlohmann::ordered_json{{"actuator", actuator.name},
                                              {"arrived", arrived},
                                              {"start", jog.start()},
                                              {"commanded", jog.commanded()},
                                              {"measured", record.measured},
                                              {"verdict", text}}
                           .dump());
  else
    fmt::print("{}\n", text);
  return arrived ? 0 : 1;
}

}  // namespace tendril::app
