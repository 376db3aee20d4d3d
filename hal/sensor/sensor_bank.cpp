// SPDX-License-Identifier: Apache-2.0
#include "hal/sensor/sensor_bank.h"

#include <algorithm>
#include <cmath>

namespace tendril::hal {
namespace {

constexpr double kOldest_s = 1e6;  // so that every age fits an int64 of ns

}  // namespace

std::vector<uint32_t> SensorBank::identifiers() const {
  std::vector<uint32_t> ids;
  for (const SensorConfig& sensor : sensors_) ids.push_back(marked_id(sensor.id, sensor.extended));
  return ids;
}

bool SensorBank::receive(const Frame& frame, int64_t arrival_ns) noexcept {
  size_t first_signal = 0;
  for (size_t s = 0; s < sensors_.size(); ++s) {
    if (sensors_[s].id == frame.id && sensors_[s].extended == frame.extended) {
      take_in(s, first_signal, frame, arrival_ns);
      return true;
    }
    first_signal += sensors_[s].signals.size();
  }
  return false;
}

void SensorBank::take_in(size_t sensor, size_t first_signal, const Frame& frame,
                         int64_t arrival_ns) noexcept {
  const SensorConfig& config = sensors_[sensor];
  std::array<double, kMaxSensorSignals> values;
  for (size_t k = 0; k < config.signals.size(); ++k) {
    const auto value = decode(config.signals[k], frame);
    if (!value) return;
    values[k] = *value;
  }
  double age_s = 0;
  if (config.age) {
    const auto age = decode(*config.age, frame);
    if (!age) return;
    age_s = std::clamp(*age, 0.0, kOldest_s);
  }
  std::copy_n(values.begin(), config.signals.size(),
              readings_.value.begin() + static_cast<std::ptrdiff_t>(first_signal));
  readings_.stamp_ns[sensor] = arrival_ns - std::llround(1e9 * age_s);
}

const SensorReadings& SensorBank::judge(int64_t now_ns) noexcept {
  if (started_ns_ == 0) started_ns_ = judged_ns_ = now_ns;
  readings_.ready = true;
  readings_.lost = -1;
  for (size_t s = 0; s < sensors_.size(); ++s) {
    const int64_t timeout_ns = sensors_[s].timeout_ns, stamp_ns = readings_.stamp_ns[s];
    if (now_ns - judged_ns_ > timeout_ns) pause_end_ns_[s] = now_ns;
    readings_.fresh[s] = stamp_ns != 0 && now_ns - stamp_ns <= timeout_ns;
    if (readings_.fresh[s] || !sensors_[s].required) continue;
    readings_.ready = false;
    const bool had_time = stamp_ns == 0 ? now_ns - started_ns_ > start_timeout_ns_
                                        : now_ns - std::max(stamp_ns, pause_end_ns_[s]) > timeout_ns;
    if (had_time && readings_.lost < 0) readings_.lost = static_cast<int>(s);
  }
  judged_ns_ = now_ns;
  return readings_;
}

}  // namespace tendril::hal
