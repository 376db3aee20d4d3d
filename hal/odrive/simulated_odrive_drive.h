#pragma once

#include <cstdint>

#include "hal/bus/frame_batch.h"
#include "hal/odrive/odrive.h"
#include "hal/sim/simulated_drive.h"
#include "hal/sim/simulated_servo.h"

namespace tendril::hal {

inline constexpr double kOdrivePositionGain = 20;  // 1/s, as delivered

/// What a simulated ODrive axis is made of. Durations in ns.
struct SimulatedOdriveSpec {
  int node = 0;  // 0..63
  OdriveFirmware firmware = OdriveFirmware::k0_6;
  double top_speed = 100;  // rev/s, > 0
  double position = 0;     // where it stands at power-on, rev
  ServoTuning tuning{.position_gain = kOdrivePositionGain};
  double torque_limit = 1;              // Nm, > 0: SimulatedServo's force limit
  double torque_constant = 8.27 / 270;  // Nm/A: of a motor of 270 rpm/V [the maker's motor guide]
  double supply_voltage = 24;           // V
  int encoder_counts = 8192;            // in a turn, > 0: positions are told in steps of one
  bool calibrated = true;               // false: it refuses closed-loop control, as without a reference
  /// As firmware 0.5 of commit 073da34: tells 0 for its position until its first closed-loop control, and
  /// begins that with its true position for an input.
  bool late_estimator = false;
  int64_t heartbeat_ns = 100'000'000;
  int64_t encoder_period_ns = 10'000'000;
  int64_t watchdog_ns = 0;  // without a frame for that long it disarms; 0: never
};

/// One simulated ODrive axis in position or torque control with the input passed through.
///
/// It moves as SimulatedServo does, with the velocity of the input fed forward; in torque control it pushes
/// with the input torque. Outside closed-loop control the position stays where it is. Spoken are the messages
/// of OdriveMessage; other states than idle and closed-loop control, and other modes, are refused or do not
/// move it. What it tells, a remote frame or one without data asks for; to any other message a remote frame
/// is one without data, which orders an emergency stop or clears errors as well. It draws the current that
/// its load takes, and the power that its motion does: losses and inertia are left out. The watchdog runs in
/// every state. [CANSimple::do_command, Axis::watchdog_check, Controller::update of firmware 0.5]
class SimulatedOdriveDrive {
 public:
  /// Powers the axis on. Real-time: yes.
  explicit SimulatedOdriveDrive(const SimulatedOdriveSpec& spec) noexcept;

  /// Takes in a frame at an instant and appends the answers; frames of others are ignored.
  /// @param now_ns  never before an earlier call's
  /// Real-time: yes (bounded, no allocation).
  void receive(const Frame& frame, int64_t now_ns, FrameBatch& out) noexcept;

  /// Lets time pass up to `now_ns`: motion, watchdog, heartbeats, encoder estimates.
  /// Real-time: yes (bounded, no allocation).
  void advance(int64_t now_ns, FrameBatch& out) noexcept;

  /// Position of the axis, rev. Real-time: yes.
  double position() const noexcept { return servo_.position(); }

  /// State of the axis as its heartbeat tells it. Real-time: yes.
  uint8_t state() const noexcept { return state_; }

  /// Error bits as its heartbeat tells them. Real-time: yes.
  uint32_t axis_error() const noexcept { return error_; }

  /// State of the power stage, whatever the protocol calls it. Real-time: yes.
  PowerStage power_stage() const noexcept;

  /// Makes the axis fail with those error bits. Real-time: yes.
  void inject_fault(uint32_t error) noexcept;

  /// Makes it fail as a hot power stage would. Real-time: yes.
  void overheat() noexcept;

  /// Jams its mechanics, or lets them go. Real-time: yes.
  void set_jammed(bool jammed) noexcept { servo_.set_jammed(jammed); }

  /// As SimulatedServo. Real-time: yes.
  void set_load(double load) noexcept;

  /// Unplugs the motor: the axis disarms with axis error 0, as firmware 0.5 does (ODrive issue 700).
  /// Real-time: yes.
  void unplug_motor() noexcept;

 private:
  void obey(OdriveMessage message, const Frame& frame, FrameBatch& out) noexcept;
  void tell(OdriveMessage message, FrameBatch& out) const noexcept;
  void request_state(uint32_t state) noexcept;
  void refuse(uint8_t result) noexcept;
  Frame estimates() const noexcept;
  Frame heartbeat() const noexcept;
  double torque() const noexcept;
  bool too_hot() const noexcept;
  double told_position() const noexcept;
  void disarm() noexcept;
  void move(int64_t now_ns) noexcept;

  SimulatedOdriveSpec spec_;
  uint8_t state_ = kOdriveIdle;
  uint32_t error_ = 0;
  uint32_t disarm_reason_ = 0;  // of error_, those that ended closed-loop control
  uint8_t component_errors_ = 0, result_ = kOdriveSuccess;
  OdriveMode mode_;  // as delivered
  OdriveInput input_;
  float input_torque_ = 0;  // Nm
  double load_ = 0;         // in torque limits
  SimulatedServo servo_;    // in rev
  bool tells_position_;

  bool started_ = false;  // time has begun to pass
  int64_t fed_ns_ = 0;
  int64_t next_heartbeat_ns_ = 0, next_estimates_ns_ = 0;
};

}  // namespace tendril::hal
