#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "hal/bus/bus_budget.h"
#include "hal/drive/drives.h"
#include "hal/drive/master_config.h"
#include "hal/sim/servo.h"
#include "hal/sim/simulated_drive.h"

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

/// The actuator behind a simulated drive, and how its drive is set up. Displacements in m or m³, efforts in N
/// or Pa.
struct SimulatedActuator {
  static constexpr double kUnlimited = std::numeric_limits<double>::infinity();
  double top_rate = 0;                                         // per second, > 0, of its displacement
  double displacement = 0;                                     // at power-on
  double force_limit = kUnlimited;                             // > 0: greatest effort that the motor holds
  double acceleration_time = ServoTuning{}.acceleration_time;  // s, see ServoTuning
  double friction = ServoTuning{}.friction;
  std::optional<double> position_gain{};  // 1/s; none: as drives of the protocol are delivered
  double following_error = kUnlimited;    // > 0: a CiA 402 drive fails where it is farther from its set-point
  int encoder_counts = 8192;              // in a turn of an ODrive axis, > 0
};

/// The drive's side of the configured protocol.
/// @param axis  index into config.axes, which are as `check` wants them
std::unique_ptr<SimulatedDrive> make_drive(const MasterConfig& config, int axis,
                                           const SimulatedActuator& actuator);

}  // namespace tendril::hal
