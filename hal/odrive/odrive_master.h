// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "hal/bus/bus_budget.h"
#include "hal/drive/axis_table.h"
#include "hal/drive/supervisor.h"
#include "hal/odrive/odrive_axis.h"

namespace tendril::hal {

/// Checks ranges, and that no two senders share an identifier: a node owns all 32 of its messages.
/// @throws std::invalid_argument with a sentence that names the axis and what is expected
/// Real-time: no.
void check_odrive(const MasterConfig& config);

/// The frames of a running robot, for the bus budget: inputs, estimates, heartbeats; without the sensors'.
/// Real-time: no (allocates).
std::vector<PeriodicFrames> odrive_frames(const MasterConfig& config);

/// The identifiers of the frames that are received from an axis: heartbeat, encoder estimates. Real-time:
/// yes.
std::array<uint32_t, 2> received_odrive_ids(const AxisConfig& axis) noexcept;

/// The controller's side of ODrive axes over CANSimple, all axes of a robot.
///
/// A cycle's frames are one input position or torque for each axis, and the orders of those that are being
/// enabled or disabled. Errors that are there before an axis is enabled, as after the death of a former
/// controller, are cleared when it is; later ones need Command::reset. CANSimple cannot switch a watchdog
/// off: after Command::finish the axes are idle and receive nothing, so that their watchdogs expire. The
/// next enabling clears that error.
class OdriveMaster final : public DriveMaster {
 public:
  /// @throws std::invalid_argument where the configuration is not sound, see check_odrive
  /// Real-time: no (allocates).
  explicit OdriveMaster(MasterConfig config);

  std::vector<uint32_t> identifiers() const override;
  void receive(const Frame& frame, int64_t arrival_ns) noexcept override;
  const Measurement& measure(BusHealth health, int64_t now_ns) noexcept override;
  void command(const Command& command, int64_t now_ns, FrameBatch& out) noexcept override;
  std::string describe(const DriveFault& fault) const override;

 private:
  MasterConfig config_;
  std::vector<OdriveAxis> axes_;
  AxisTable axis_table_;
  Supervisor supervisor_;
};

}  // namespace tendril::hal
