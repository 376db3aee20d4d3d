#include "app/daemon/measured_signals.h"

#include "app/robot/robot.h"

namespace tendril::app {

MeasuredSignals::MeasuredSignals(const Config& config) : efforts(config.actuators.size()) {
  for (const EffectorRow& row : effector_rows(config))
    if (row.effector == 0) tip_axes.push_back(row.axis);
  std::size_t signal = 0;
  for (std::size_t s = 0; s < config.sensors.size(); ++s)
    for (const MeasuredConfig& measured : config.sensors[s].measures) {
      const SignalIndex index{s, signal++};
      if (measured.actuator >= 0)
        efforts[measured.actuator] = index;
      else if (measured.effector == 0)
        tip[measured.axis] = index;
      else
        others.push_back({index, config.effectors[measured.effector].name, measured.axis});
    }
}

}  // namespace tendril::app
