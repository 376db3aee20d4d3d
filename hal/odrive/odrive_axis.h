#pragma once

#include <cstdint>

#include "hal/bus/frame_batch.h"
#include "hal/drive/drives.h"
#include "hal/drive/range_watch.h"
#include "hal/odrive/odrive.h"
#include "hal/odrive/odrive_settings.h"

namespace tendril::hal {

/// The master's view of one ODrive axis: its way into closed-loop control and its supervision. Part of
/// OdriveMaster.
///
/// Stages: listen until heartbeat and position were heard, run, finish. Within the running stage a phase says
/// what we want of the power stage and how far the axis has followed: off; preparing (errors of an earlier
/// life are cleared); closing (closed-loop control is ordered); on.
///
/// CANSimple has no flag that says whether an axis has a reference: what its positions count from, those who
/// set it up must know. It must accept closed-loop control, as it does with an absolute encoder or its index
/// found, and its position must then be the one that it told before. Some firmware tells 0 until the first
/// closed-loop control (see odrive_axis.cpp), so from that order until a position has come back no position
/// is commanded, and one that differs by more than kHeldWithin is a fault. Real-time: every function but the
/// constructor (bounded, no allocation).
class OdriveAxis {
 public:
  /// Largest step of a position at enabling that is not a fault, rev: the sag of a loaded winch.
  static constexpr double kHeldWithin = 0.1;

  /// @param config  outlives the axis
  OdriveAxis(const AxisConfig& axis, const MasterConfig& config);

  /// Takes in a frame if it is one of this axis'.
  void receive(const Frame& frame, int64_t arrival_ns) noexcept;

  /// Judges the time-outs.
  /// @param asked_ns  as Supervisor::measure has it
  void supervise(int64_t now_ns, int64_t asked_ns) noexcept;

  /// Appends the frames of this cycle: one input position or torque as a rule, which feeds the watchdog of
  /// the axis too, and five at most.
  /// @param enable       whether it shall be in closed-loop control
  /// @param may_begin    whether an axis at rest may begin to be enabled now
  /// @param may_close    whether one that is prepared may be ordered into closed-loop control now
  /// @param all_enabled  whether every axis is, so that targets are followed
  void drive(bool enable, bool may_begin, bool may_close, bool all_enabled, const AxisTarget& target,
             int64_t now_ns, FrameBatch& out) noexcept;

  /// Starts afresh from listening, whatever the axis did.
  void restart() noexcept;

  /// Ends the talk with an axis that is disabled.
  void release() noexcept { stage_ = Stage::kFinished; }

  /// Whether the next order, if there is one, is closed-loop control: it is off, idle and without an error.
  bool prepared() const noexcept;

  bool finished() const noexcept { return stage_ == Stage::kFinished; }

  /// Whether the position was at that instant younger than the feedback timeout.
  bool known(int64_t asked_ns) const noexcept;

  /// Whether the axis was brought to closed-loop control and is there.
  bool enabled() const noexcept { return phase_ == Phase::kOn; }

  /// Whether nothing is known that says the axis holds torque.
  bool disabled() const noexcept;

  /// Last known displacement, m or m³; 0 before the first.
  double position() const noexcept { return scale_.to_displacement(position_); }

  /// When it arrived; 0 since the start or restart of the axis.
  int64_t position_stamp_ns() const noexcept { return position_stamp_ns_; }

  /// The fault that took the axis out of operation, until restart.
  const DriveFault& fault() const noexcept { return fault_; }

  // How DriveFault::code packs what an axis told of itself when it was not in closed-loop control.
  static uint8_t state_of(uint32_t code) noexcept { return static_cast<uint8_t>(code); }
  static uint8_t result_of(uint32_t code) noexcept { return static_cast<uint8_t>(code >> 8); }
  static uint8_t components_of(uint32_t code) noexcept { return static_cast<uint8_t>(code >> 16); }

 private:
  enum class Stage : uint8_t { kListening, kRunning, kFinished, kFailed };
  enum class Phase : uint8_t { kOff, kPreparing, kClosing, kOn };

  void on_heartbeat(const OdriveHeartbeat& heartbeat, int64_t arrival_ns) noexcept;
  void on_estimates(const OdriveEstimates& estimates, int64_t arrival_ns) noexcept;
  void prepare(int64_t now_ns, FrameBatch& out) noexcept;
  void close(int64_t now_ns, FrameBatch& out) noexcept;
  void wait_for_closed_loop(int64_t now_ns, FrameBatch& out) noexcept;
  void follow(bool all_enabled, double displacement, FrameBatch& out) noexcept;
  void idle_input(FrameBatch& out) const noexcept;
  void rest(int64_t now_ns, FrameBatch& out) noexcept;
  bool order(uint8_t state, int64_t now_ns, FrameBatch& out) noexcept;
  void push_mode(FrameBatch& out) const noexcept;
  void push_input(double position, double velocity, FrameBatch& out) const noexcept;
  void push_torque(double torque, FrameBatch& out) const noexcept;
  bool closed() const noexcept { return heartbeat_.state == kOdriveClosedLoop; }
  void fail(FaultKind kind, uint32_t code) noexcept;
  uint32_t packed() const noexcept;

  const MasterConfig& config_;
  int node_;
  AxisScale scale_;
  OdriveFirmware firmware_;
  OdriveAxisSettings settings_;
  bool follows_effort_;
  RangeWatch range_;

  Stage stage_ = Stage::kListening;
  int64_t stage_since_ns_ = 0;  // 0: supervision has not begun
  OdriveHeartbeat heartbeat_;   // the last
  int64_t heartbeat_ns_ = 0;    // its arrival; 0: none yet
  int64_t cleared_ns_ = 0;      // heartbeat after which errors were last cleared

  Phase phase_ = Phase::kOff;
  int64_t enabling_since_ns_ = 0;
  uint8_t ordered_state_ = kOdriveUndefined;
  int64_t ordered_ns_ = 0;
  bool following_ = false;  // targets of the controller rather than the position at enabling

  double position_ = 0;            // rev, as last told
  int64_t position_stamp_ns_ = 0;  // 0: position unknown
  double held_ = 0;                // rev, told before closed-loop control was ordered
  double target_ = 0;              // rev
  double torque_ = 0;              // Nm
  DriveFault fault_;
};

}  // namespace tendril::hal
