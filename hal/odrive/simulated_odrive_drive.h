// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/bus/frame_batch.h"
#include "hal/odrive/odrive.h"
#include "hal/sim/simulated_drive.h"
#include "hal/sim/simulated_servo.h"

namespace tendril::hal {

inline constexpr double kOdrivePositionGain = 20;  // 1/s, as delivered

/// The properties of a simulated ODrive axis. Durations in ns.
struct SimulatedOdriveSpec {
  int node = 0;  // 0..63
  OdriveFirmware firmware = OdriveFirmware::k0_6;
  double top_speed = 100;  // rev/s, > 0
  double position = 0;     // at power-on, rev
  ServoTuning tuning{.position_gain = kOdrivePositionGain};
  double torque_limit = 1;              // Nm, > 0: SimulatedServo's force limit
  double torque_constant = 8.27 / 270;  // Nm/A: of a motor of 270 rpm/V [the maker's motor guide]
  double supply_voltage = 24;           // V
  int encoder_counts = 8192;            // in a turn, > 0: resolution of the positions that are sent
  bool calibrated = true;               // false: it refuses closed-loop control, as without a reference
  /// As firmware 0.5 of commit 073da34: it sends the position 0 until its first closed-loop control, and
  /// begins that with its true position as the input.
  bool late_estimator = false;
  int64_t heartbeat_ns = 100'000'000;
  int64_t encoder_period_ns = 10'000'000;
  int64_t watchdog_ns = 0;    // without a frame for that long it disarms; 0: never
  bool left_enabled = false;  // at power-on it is in closed-loop control, as another controller left it
};

/// One simulated ODrive axis in position or torque control with the input passed through.
///
/// It moves as SimulatedServo does, with the velocity of the input fed forward; in torque control it exerts
/// the input torque. Outside closed-loop control its position stays. It supports the messages of
/// OdriveMessage. Other states than idle and closed-loop control are refused; other modes do not move it. A
/// remote frame, or one without data, requests a value. A remote frame of any other message counts as one
/// without data, so it can also cause an emergency stop or clear errors. Its current is that of its load,
/// its supply power that of its motion: losses and inertia are left out. The watchdog runs in every state.
/// [CANSimple::do_command, Axis::watchdog_check, Controller::update of firmware 0.5]
class SimulatedOdriveDrive {
 public:
  /// Powers the axis on. Real-time: yes.
  explicit SimulatedOdriveDrive(const SimulatedOdriveSpec& spec) noexcept;

  /// Processes a frame at an instant and appends the answers; frames for other nodes are ignored.
  /// @param now_ns  never before an earlier call's
  /// Real-time: yes (bounded, no allocation).
  void receive(const Frame& frame, int64_t now_ns, FrameBatch& out) noexcept;

  /// Lets time pass up to `now_ns`: motion, watchdog, heartbeats, encoder estimates.
  /// Real-time: yes (bounded, no allocation).
  void advance(int64_t now_ns, FrameBatch& out) noexcept;

  /// Position of the axis, rev. Real-time: yes.
  double position() const noexcept { return servo_.position(); }

  /// State of the axis as in its heartbeat. Real-time: yes.
  uint8_t state() const noexcept { return state_; }

  /// Error bits as in its heartbeat. Real-time: yes.
  uint32_t axis_error() const noexcept { return error_; }

  /// State of the power stage. Real-time: yes.
  PowerStage power_stage() const noexcept;

  /// Makes the axis fail with those error bits. Real-time: yes.
  void inject_fault(uint32_t error) noexcept;

  /// Makes it fail with the error of a hot power stage. Real-time: yes.
  void overheat() noexcept;

  /// Jams its mechanics, or releases them. Real-time: yes.
  void set_jammed(bool jammed) noexcept { servo_.set_jammed(jammed); }

  /// See SimulatedServo. Real-time: yes.
  void set_load(double load) noexcept;

  /// Unplugs the motor: the axis disarms with axis error 0, as firmware 0.5 does (ODrive issue 700).
  /// Real-time: yes.
  void unplug_motor() noexcept;

 private:
  void handle(OdriveMessage message, const Frame& frame, FrameBatch& out) noexcept;
  void answer(OdriveMessage message, FrameBatch& out) const noexcept;
  void request_state(uint32_t state) noexcept;
  void refuse_state(uint8_t result) noexcept;
  Frame estimates() const noexcept;
  Frame heartbeat() const noexcept;
  double torque() const noexcept;
  bool is_too_hot() const noexcept;
  double reported_position() const noexcept;
  void disarm() noexcept;
  void move(int64_t now_ns) noexcept;

  SimulatedOdriveSpec spec_;
  uint8_t state_ = kOdriveIdle;
  uint32_t error_ = 0;
  uint32_t disarm_reason_ = 0;  // the bits of error_ that ended closed-loop control
  uint8_t component_errors_ = 0, result_ = kOdriveSuccess;
  OdriveMode mode_;  // as delivered
  OdriveInput input_;
  float input_torque_ = 0;  // Nm
  double load_ = 0;         // in torque limits
  SimulatedServo servo_;    // in rev
  bool reports_position_;

  bool started_ = false;  // time has begun to pass
  int64_t fed_ns_ = 0;
  int64_t next_heartbeat_ns_ = 0, next_estimates_ns_ = 0;
};

}  // namespace tendril::hal
