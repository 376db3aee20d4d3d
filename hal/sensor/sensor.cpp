// SPDX-License-Identifier: Apache-2.0
#include "hal/sensor/sensor.h"

#include <cstdio>
#include <set>
#include <stdexcept>

namespace tendril::hal {
namespace {

[[noreturn]] void refuse_sensor(const SensorConfig& sensor, const std::string& what) {
  throw std::invalid_argument("sensor '" + sensor.name + "': " + what);
}

void check_frame(const SensorConfig& sensor) {
  if (sensor.id > (sensor.extended ? 0x1FFF'FFFFu : 0x7FFu))
    refuse_sensor(sensor,
                  sensor.extended ? "the identifier must fit 29 bits" : "the identifier must fit 11 bits");
  if (sensor.length < 1 || sensor.length > 8) refuse_sensor(sensor, "the length must be within 1..8 bytes");
  if (!(sensor.rate_hz > 0)) refuse_sensor(sensor, "the rate must be positive");
  if (sensor.timeout_ns <= 0) refuse_sensor(sensor, "the timeout must be positive");
  if (sensor.signals.empty()) refuse_sensor(sensor, "there must be a signal");
}

void check_signals(const SensorConfig& sensor) {
  std::vector<Signal> signals = sensor.signals;
  if (sensor.age) signals.push_back(*sensor.age);
  uint64_t taken = 0;
  std::set<std::string> names;
  for (const Signal& signal : signals) {
    check(signal);
    const std::string who = "signal '" + signal.name + "' ";
    if (bytes_needed(signal) > sensor.length)
      refuse_sensor(sensor, who + "reaches beyond the frame's length");
    if (!names.insert(signal.name).second) refuse_sensor(sensor, who + "is there twice");
    if ((taken & bits_of(signal)) != 0) refuse_sensor(sensor, who + "overlaps with another");
    taken |= bits_of(signal);
  }
}

}  // namespace

void check(const std::vector<SensorConfig>& sensors) {
  size_t signals = 0;
  for (const SensorConfig& sensor : sensors) {
    check_frame(sensor);
    check_signals(sensor);
    signals += sensor.signals.size();
  }
  if (sensors.size() > kMaxSensors || signals > kMaxSensorSignals)
    throw std::invalid_argument("there must be at most " + std::to_string(kMaxSensors) + " sensors with " +
                                std::to_string(kMaxSensorSignals) + " signals, not " +
                                std::to_string(sensors.size()) + " with " + std::to_string(signals));
}

std::string describe_loss(const SensorConfig& sensor) {
  char limit[32];
  std::snprintf(limit, sizeof limit, "%g ms", 1e-6 * static_cast<double>(sensor.timeout_ns));
  return "sensor '" + sensor.name + "': no sample younger than " + limit;
}

std::optional<Frame> encode_sample(const SensorConfig& sensor, std::span<const double> values,
                                   int64_t age_ns) noexcept {
  Frame frame{.id = sensor.id, .extended = sensor.extended, .length = static_cast<uint8_t>(sensor.length)};
  for (size_t k = 0; k < sensor.signals.size(); ++k)
    if (!encode(sensor.signals[k], values[k], frame)) return std::nullopt;
  if (sensor.age && !encode(*sensor.age, 1e-9 * static_cast<double>(age_ns), frame)) return std::nullopt;
  return frame;
}

}  // namespace tendril::hal
