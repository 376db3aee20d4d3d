#pragma once

#include <memory>
#include <vector>

#include "hal/bus_budget.h"
#include "hal/drives.h"
#include "hal/master_config.h"
#include "hal/simulated_drive.h"

/// The one place that knows which protocols there are. Real-time: no, for all of it (allocates).
namespace tendril::hal {

/// Checks a configuration: ranges, and that no two senders share an identifier.
/// @throws std::invalid_argument with a sentence that names the axis and what is expected
void check(const MasterConfig& config);

/// The frames of a running robot, for the bus budget.
std::vector<PeriodicFrames> periodic_frames(const MasterConfig& config);

/// The identifier of the heartbeats of an axis' drive.
/// @param axis  index into config.axes
uint32_t heartbeat_identifier(const MasterConfig& config, int axis);

/// The controller's side of the configured protocol.
/// @throws std::invalid_argument as `check`
std::unique_ptr<DriveMaster> make_master(const MasterConfig& config);

/// The actuator behind a simulated drive.
struct SimulatedActuator {
  double top_rate = 0;      // m/s or m³/s, > 0, of its displacement
  double displacement = 0;  // at power-on, m or m³
};

/// The drive's side of the configured protocol.
/// @param axis  index into config.axes, which are as `check` wants them
std::unique_ptr<SimulatedDrive> make_drive(const MasterConfig& config, int axis,
                                           const SimulatedActuator& actuator);

}  // namespace tendril::hal
