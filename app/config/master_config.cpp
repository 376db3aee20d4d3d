// SPDX-License-Identifier: Apache-2.0
#include "app/config/master_config.h"

#include <algorithm>
#include <cmath>

namespace tendril::app {
namespace {

// For another controller: several of its heartbeats, or of its commands where it sends no heartbeat.
constexpr int64_t kListenHeartbeats = 4, kLeastListening_ns = 200'000'000;

}  // namespace

hal::MasterConfig master_config(const Config& config) {
  hal::MasterConfig result = config.bus.master;
  result.axes.clear();
  for (const ActuatorConfig& actuator : config.actuators) {
    hal::AxisConfig axis = actuator.drive;
    axis.name = actuator.name;
    axis.displacement_min = actuator.displacement_min;
    axis.displacement_max = actuator.displacement_max;
    axis.top_rate = actuator.top_rate;
    axis.moves_volume = actuator.is_cavity();
    axis.largest_effort = std::max(std::abs(actuator.effort_min), std::abs(actuator.effort_max));
    result.axes.push_back(axis);
  }
  result.period_ns = std::llround(1e9 / config.control.rate_hz);
  result.listen_ns = std::max(kListenHeartbeats * result.heartbeat_ns, kLeastListening_ns);
  result.sensors.clear();
  for (const SensorConfig& sensor : config.sensors) result.sensors.push_back(sensor.frame);
  return result;
}

}  // namespace tendril::app
