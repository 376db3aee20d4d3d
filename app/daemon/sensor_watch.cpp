// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/sensor_watch.h"

namespace tendril::app {

std::vector<SensorWatch::Change> SensorWatch::add(const rt::TraceRecord& record) {
  std::vector<Change> changes;
  if (record.phase != rt::Phase::kRunning) return changes;
  for (std::size_t s = 0; s < losses_.size(); ++s) {
    Losses& sensor = losses_[s];
    if (sensor.lost) sensor.stale_ns += record.intended_ns - last_ns_;
    if (sensor.lost != record.sensors.fresh[s]) continue;
    sensor.lost = !sensor.lost;
    changes.push_back({s, sensor.lost, 1e-9 * static_cast<double>(record.intended_ns - sensor.since_ns)});
    if (!sensor.lost) continue;
    ++sensor.count;
    sensor.since_ns = record.intended_ns;
  }
  last_ns_ = record.intended_ns;
  return changes;
}

}  // namespace tendril::app
