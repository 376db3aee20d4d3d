// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/bus/frame_batch.h"
#include "hal/drive/drives.h"
#include "hal/drive/following_monitor.h"
#include "hal/drive/range_monitor.h"
#include "hal/odrive/odrive.h"
#include "hal/odrive/odrive_settings.h"

namespace tendril::hal {

/// The master's view of one ODrive axis: it enables, commands and monitors the axis. Part of OdriveMaster.
///
/// Stages: listen until a heartbeat and a position have come, run, finish. Within the running stage a phase
/// says how far enabling is: off; preparing (old errors are cleared); entering closed-loop control (it is
/// requested); on.
///
/// CANSimple has no flag that says whether an axis has a reference; the robot file must say it. The axis
/// must accept closed-loop control, as it does with an absolute encoder or after an index search. Its
/// position must then be the one before. Some firmware sends the position 0 until the first closed-loop
/// control (see odrive_axis.cpp). So from the request on no position is commanded until a position has come.
/// If that one differs by more than kMaxPositionStep, it is a fault.
/// Real-time: every function but the constructor (bounded, no allocation).
class OdriveAxis {
 public:
  /// Largest change of the position at enabling that is no fault, rev: a loaded winch gives way a little.
  static constexpr double kMaxPositionStep = 0.1;

  /// @param config  outlives the axis
  OdriveAxis(const AxisConfig& axis, const MasterConfig& config);

  /// Processes a frame if it belongs to this axis.
  void receive(const Frame& frame, int64_t arrival_ns) noexcept;

  /// Judges the time-outs.
  /// @param last_sync_ns  see Supervisor::measure
  void supervise(int64_t now_ns, int64_t last_sync_ns) noexcept;

  /// Appends the frames of this cycle: as a rule one input position or torque, which also feeds the watchdog
  /// of the axis; five at most.
  /// @param enable       whether it shall be in closed-loop control
  /// @param may_begin    whether an axis that is off may begin to be enabled now
  /// @param may_request  whether closed-loop control may be requested now
  /// @param all_enabled  whether every axis is enabled, so that targets are followed
  void drive(bool enable, bool may_begin, bool may_request, bool all_enabled, const AxisTarget& target,
             int64_t now_ns, FrameBatch& out) noexcept;

  /// Starts again from listening.
  void restart() noexcept;

  /// Ends the communication with an axis that is disabled.
  void release() noexcept { stage_ = Stage::kFinished; }

  /// Whether the axis is off, idle and without an error, so that closed-loop control can be requested. An
  /// axis that nobody has fed may say so just before its watchdog expires: it is asked once it is fed.
  bool ready_for_closed_loop() const noexcept;

  bool finished() const noexcept { return stage_ == Stage::kFinished; }

  /// Whether the position was younger than the feedback timeout at that instant.
  bool known(int64_t last_sync_ns) const noexcept;

  /// Whether the axis was brought to closed-loop control and is in it.
  bool enabled() const noexcept { return phase_ == Phase::kOn; }

  /// What is known of its power stage.
  DrivePower power() const noexcept;

  /// Last known displacement, m or m³; 0 before the first.
  double position() const noexcept { return scale_.to_displacement(position_); }

  /// When it arrived; 0 since the start or restart of the axis.
  int64_t position_stamp_ns() const noexcept { return position_stamp_ns_; }

  /// The fault that took the axis out of operation, until restart.
  const DriveFault& fault() const noexcept { return fault_; }

  // What DriveFault::code holds of the last heartbeat, where the axis was not in closed-loop control.
  static uint8_t state_of(uint32_t code) noexcept { return static_cast<uint8_t>(code); }
  static uint8_t result_of(uint32_t code) noexcept { return static_cast<uint8_t>(code >> 8); }
  static uint8_t components_of(uint32_t code) noexcept { return static_cast<uint8_t>(code >> 16); }

 private:
  enum class Stage : uint8_t { kListening, kRunning, kFinished, kFailed };
  enum class Phase : uint8_t { kOff, kPreparing, kEnteringClosedLoop, kOn };

  void on_heartbeat(const OdriveHeartbeat& heartbeat, int64_t arrival_ns) noexcept;
  void judge_power() noexcept;
  void act(bool enable, bool may_begin, bool may_request, bool all_enabled, const AxisTarget& target,
           int64_t now_ns, FrameBatch& out) noexcept;
  void on_estimates(const OdriveEstimates& estimates, int64_t arrival_ns) noexcept;
  void monitor_motion(int64_t arrival_ns) noexcept;
  void prepare(int64_t now_ns, FrameBatch& out) noexcept;
  void request_closed_loop(int64_t now_ns, FrameBatch& out) noexcept;
  void wait_for_closed_loop(int64_t now_ns, FrameBatch& out) noexcept;
  void follow(bool all_enabled, double displacement, FrameBatch& out) noexcept;
  void append_idle_input(FrameBatch& out) const noexcept;
  void disable(int64_t now_ns, FrameBatch& out) noexcept;
  bool request_state(uint8_t state, int64_t now_ns, FrameBatch& out) noexcept;
  void append_mode(FrameBatch& out) const noexcept;
  void append_input(double position, double velocity, FrameBatch& out) const noexcept;
  void append_torque(double torque, FrameBatch& out) const noexcept;
  bool in_closed_loop() const noexcept { return heartbeat_.state == kOdriveClosedLoop; }
  bool has_errors() const noexcept { return heartbeat_.axis_error != 0 || heartbeat_.component_errors != 0; }
  void fail(FaultKind kind, uint32_t code) noexcept;
  void fail(const DriveFault& fault) noexcept;
  uint32_t fault_code() const noexcept;

  const MasterConfig& config_;
  int node_;
  AxisScale scale_;
  OdriveFirmware firmware_;
  OdriveAxisSettings settings_;
  bool follows_effort_;
  RangeMonitor range_;
  FollowingMonitor following_monitor_;

  Stage stage_ = Stage::kListening;
  int64_t stage_since_ns_ = 0;  // 0: supervision has not begun
  OdriveHeartbeat heartbeat_;   // the last
  int64_t heartbeat_ns_ = 0;    // its arrival; 0: none yet
  bool silent_ = false;         // for longer than the time-out, whatever else is wrong
  int64_t cleared_ns_ = 0;      // heartbeat after which errors were last cleared
  int64_t fed_ns_ = 0;          // when its watchdog was last fed; 0: never
  int heartbeats_fed_ = 0;      // since its watchdog is fed without a pause, 2 at most

  Phase phase_ = Phase::kOff;
  int64_t enabling_since_ns_ = 0;
  uint8_t requested_state_ = kOdriveUndefined;
  int64_t requested_ns_ = 0;
  bool following_ = false;  // targets of the controller rather than the position at enabling

  double position_ = 0;            // rev, the last received
  int64_t position_stamp_ns_ = 0;  // 0: position unknown
  double position_before_ = 0;     // rev, before closed-loop control was requested
  double target_ = 0;              // rev
  double torque_ = 0;              // Nm
  bool may_be_on_ = false;  // its power stage: closed-loop control was requested, or told by a heartbeat
  DriveFault fault_;
};

}  // namespace tendril::hal
