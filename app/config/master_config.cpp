#include "app/config/master_config.h"

#include <algorithm>
#include <cmath>

namespace tendril::app {

hal::MasterConfig master_config(const Config& config) {
  hal::MasterConfig result = config.bus.master;
  result.axes.clear();
  for (const ActuatorConfig& actuator : config.actuators) {
    hal::AxisConfig axis = actuator.drive;
    axis.name = actuator.name;
    axis.displacement_min = actuator.displacement_min;
    axis.displacement_max = actuator.displacement_max;
    axis.largest_effort = std::max(std::abs(actuator.effort_min), std::abs(actuator.effort_max));
    result.axes.push_back(axis);
  }
  result.period_ns = std::llround(1e9 / config.control.rate_hz);
  result.sensors.clear();
  for (const SensorConfig& sensor : config.sensors) result.sensors.push_back(sensor.frame);
  return result;
}

}  // namespace tendril::app
