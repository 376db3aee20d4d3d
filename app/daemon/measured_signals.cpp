// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/measured_signals.h"

#include "app/robot/robot.h"

namespace tendril::app {

MeasuredSignals::MeasuredSignals(const Config& config)
    : tip_axes(app::tip_axes(config)), efforts(config.actuators.size()) {
  for (const Reading& reading : readings(config))
    if (reading.measures.actuator >= 0)
      efforts[reading.measures.actuator] = reading;
    else if (reading.measures.effector == 0)
      tip[reading.measures.axis] = reading;
    else
      others.push_back(reading);
}

}  // namespace tendril::app
