// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <string>
#include <vector>

#include "hal/cia402/cia402_axis.h"
#include "hal/cia402/cia402_settings.h"
#include "hal/drive/axis_table.h"
#include "hal/drive/drives.h"
#include "hal/drive/supervisor.h"

namespace tendril::hal {

/// The controller's side of CANopen drives in cyclic synchronous position or torque mode, all axes of a
/// robot.
///
/// Before its first frame it listens for another controller, see OtherMaster; where it hears one, it sends
/// nothing. A cycle's frames are: heartbeat if due, start-up frames of a few axes, the RPDOs, SYNC last, so
/// that all drives take their targets at the same instant and answer with their positions. The faults of
/// drives that are in fault at the start, for example because the last controller failed, are reset when they
/// are first enabled; later faults need Command::reset.
///
/// Axes that need homing are homed once every drive is connected, one after the other in their order: cables
/// pull against each other, so two axes that home at once could take the pull of the other one for an end
/// stop. Any fault, and Command::finish, ends homing.
class Cia402Master final : public DriveMaster {
 public:
  /// @throws std::invalid_argument where the configuration is not sound, see check_cia402
  /// Real-time: no (allocates).
  explicit Cia402Master(MasterConfig config);

  std::vector<uint32_t> identifiers() const override;
  void receive(const Frame& frame, int64_t arrival_ns) noexcept override;
  const Measurement& measure(BusHealth health, int64_t now_ns) noexcept override;
  void command(const Command& command, int64_t now_ns, FrameBatch& out) noexcept override;
  std::string describe(const DriveFault& fault) const override;
  std::string identity(int axis) const override;

 private:
  bool may_release(int64_t now_ns) noexcept;
  void set_up(int64_t now_ns, FrameBatch& out) noexcept;
  std::string describe_alone(const DriveFault& fault) const;
  int axis_to_home() const noexcept;

  MasterConfig config_;
  int master_node_;
  std::vector<Cia402Axis> axes_;
  AxisTable axis_table_;
  Supervisor supervisor_;
  int64_t next_heartbeat_ns_ = 0;
  int64_t finish_since_ns_ = 0;  // since Command::finish; 0: not yet
  int64_t last_sync_ns_ = 0;     // when the last SYNC went out
  std::array<std::atomic<bool>, kMaxAxes>
      identified_{};  // the names of the axis may be read by other threads
};

}  // namespace tendril::hal
