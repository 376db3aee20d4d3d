// SPDX-License-Identifier: Apache-2.0
#include "app/config/plant_fault_parser.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>
#include <vector>

#include "app/config/quantity.h"
#include "hal/drive/drive_protocol.h"

namespace tendril::app {
namespace {

using Kind = PlantFaultKind;

/// Words in lower case stand for themselves. Those in upper case are filled in: AXIS, the name of an
/// actuator; SENSOR, that of a sensor; CODE, a whole number; TIME, SIZE and SHARE, a number and a unit.
struct Row {
  Kind kind;
  std::string pattern;
  std::string_view effect;
  uint32_t largest_code = 0;
};

/// The failure of a drive is named as its protocol does.
std::vector<Row> rows_of(const hal::DriveProtocol& protocol) {
  const hal::FaultInjection drive = protocol.fault_injection();
  return {
      {Kind::kDriveFault, fmt::format("fault AXIS {} CODE", drive.word), drive.effect, drive.largest_code},
      {Kind::kSilent, "heartbeat AXIS off", "its drive's heartbeats no longer come, all else goes on"},
      {Kind::kStuck, "stuck AXIS", "its mechanics jam; the drive says nothing of it"},
      {Kind::kCut, "cut AXIS", "its cable never pulls again, though the drive turns"},
      {Kind::kDelay, "delay TIME", "what the robot sends arrives so much later (at most 1 s)"},
      {Kind::kDrop, "drop SHARE", "so many of all frames are lost, both ways (0 % to 100 %)"},
      {Kind::kNoise, "noise SIZE",
       "what is measured in that unit (mm, N, Pa) errs by that standard deviation"},
      {Kind::kSensorSilent, "sensor SENSOR off", "it sends nothing"},
      {Kind::kBusOff, "bus off", "the robot neither sends nor hears"},
      {Kind::kClear, "clear", "all of it ends, but for cut cables and what a reset must clear"},
  };
}

std::vector<std::string_view> words_of(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  std::vector<std::string_view> words;
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
    if (text.empty()) return words;
    words.push_back(text.substr(0, text.find_first_of(kBlanks)));
    text.remove_prefix(words.back().size());
  }
}

[[noreturn]] void mistake(std::string_view expected, const Row& row) {
  throw PlantFaultMistake(fmt::format("{}, as in '{}'", expected, row.pattern));
}

int read_axis(std::string_view word, std::span<const ActuatorConfig> actuators, const Row& row) {
  const auto found = std::ranges::find(actuators, word, &ActuatorConfig::name);
  if (found == actuators.end()) {
    std::string names;
    for (const ActuatorConfig& actuator : actuators) names += (names.empty() ? "" : ", ") + actuator.name;
    mistake("the name of an actuator (" + names + ")", row);
  }
  if (row.kind == Kind::kCut && !std::holds_alternative<CableConfig>(found->kind))
    mistake("an actuator that is a cable", row);
  return static_cast<int>(found - actuators.begin());
}

int read_sensor_name(std::string_view word, std::span<const SensorConfig> sensors, const Row& row) {
  const auto found =
      std::ranges::find(sensors, word, [](const SensorConfig& sensor) { return sensor.frame.name; });
  if (found == sensors.end()) {
    std::string names;
    for (const SensorConfig& sensor : sensors) names += (names.empty() ? "" : ", ") + sensor.frame.name;
    mistake("the name of a sensor (" + names + ")", row);
  }
  return static_cast<int>(found - sensors.begin());
}

double read_code(std::string_view word, const Row& row) {
  const bool hexadecimal = word.starts_with("0x");
  const std::string_view digits = hexadecimal ? word.substr(2) : word;
  uint32_t code = 0;
  const auto [stop, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), code, hexadecimal ? 16 : 10);
  if (error != std::errc() || stop != digits.data() + digits.size() || code == 0 || code > row.largest_code)
    mistake(fmt::format("a code from 0x1 to 0x{:X}", row.largest_code), row);
  return code;
}

double read_share(std::string_view number, std::string_view unit, const Row& row) {
  double percent = -1;
  if (unit != "%" || !parse_quantity(number, Dimension::kNumber, {&percent, 1}) || percent < 0 ||
      percent > 100)
    mistake("a share from 0 % to 100 %", row);
  return percent / 100;
}

/// A number with a unit, 0 or of a magnitude that the robot file allows too.
/// @param most  a bound of its own, within that of the robot file
std::optional<double> read_size(const std::string& text, Dimension dimension, double most) {
  double value = -1;
  if (!parse_quantity(text, dimension, {&value, 1}) || value > most) return std::nullopt;
  if (value != 0 && value < magnitudes_of(dimension).least) return std::nullopt;
  return value;
}

/// "0, or 1e-06 to 1 s (s, ms, us)"
std::string describe_size(Dimension dimension, double most) {
  return fmt::format("0, or {:g} to {:g} {} ({})", magnitudes_of(dimension).least, most, si_unit(dimension),
                     units_of(dimension));
}

double read_delay(const std::string& text, const Row& row) {
  constexpr double kLongest_s = 1;
  const auto delay = read_size(text, Dimension::kTime, kLongest_s);
  if (!delay) mistake("a delay of " + describe_size(Dimension::kTime, kLongest_s), row);
  return *delay;
}

/// What errs follows from the unit.
void read_noise(const std::string& text, const Row& row, PlantFault& fault) {
  std::string expected;
  for (const auto& [dimension, kind] :
       {std::pair(Dimension::kLength, Kind::kNoise), std::pair(Dimension::kForce, Kind::kForceNoise),
        std::pair(Dimension::kPressure, Kind::kPressureNoise)}) {
    const double most = magnitudes_of(dimension).greatest;
    if (const auto deviation = read_size(text, dimension, most)) {
      fault.kind = kind;
      fault.value = *deviation;
      return;
    }
    expected += (expected.empty() ? "" : "; ") + describe_size(dimension, most);
  }
  mistake("a length, force or pressure: " + expected, row);
}

/// @return  nothing where the line is of another row
std::optional<PlantFault> match(const Row& row, const std::vector<std::string_view>& words,
                                const Config& config) {
  const std::vector<std::string_view> pattern = words_of(row.pattern);
  if (words.empty() || words[0] != pattern[0]) return std::nullopt;
  PlantFault fault{.kind = row.kind};
  size_t at = 0;
  const auto next = [&] { return at < words.size() ? words[at++] : std::string_view(); };
  const auto quantity = [&](std::string_view number) { return fmt::format("{} {}", number, next()); };
  for (const std::string_view word : pattern) {
    const std::string_view given = next();
    if (word == "AXIS")
      fault.axis = read_axis(given, config.actuators, row);
    else if (word == "SENSOR")
      fault.axis = read_sensor_name(given, config.sensors, row);
    else if (word == "CODE")
      fault.value = read_code(given, row);
    else if (word == "SHARE")
      fault.value = read_share(given, next(), row);
    else if (word == "TIME")
      fault.value = read_delay(quantity(given), row);
    else if (word == "SIZE")
      read_noise(quantity(given), row, fault);
    else if (word != given)
      mistake(fmt::format("'{}'", word), row);
  }
  if (at < words.size()) mistake("the end of the line", row);
  return fault;
}

}  // namespace

PlantFault parse_plant_fault(std::string_view line, const Config& config) {
  const std::vector<std::string_view> words = words_of(line);
  const std::vector<Row> rows = rows_of(*config.bus.master.protocol);
  for (const Row& row : rows)
    if (const auto fault = match(row, words, config)) return *fault;
  std::string known;
  for (const Row& row : rows) known += fmt::format("{}'{}'", known.empty() ? "" : ", ", row.pattern);
  throw PlantFaultMistake("one of " + known);
}

std::string plant_fault_help(const hal::DriveProtocol& protocol) {
  std::string text;
  for (const Row& row : rows_of(protocol)) text += fmt::format("{:22} {}\n", row.pattern, row.effect);
  return text;
}

}  // namespace tendril::app
