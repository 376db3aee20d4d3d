// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/cia402/simulated_cia402_spec.h"
#include "hal/cia402/simulated_object_dictionary.h"
#include "hal/sim/simulated_servo.h"

namespace tendril::hal {

/// The axis of a simulated CiA 402 drive: how it moves in cyclic synchronous position mode, cyclic
/// synchronous torque mode and homing mode, and its share of the statusword. [CiA 402-2]
///
/// Target positions are interpolated over the interpolation period. Homing methods: 17 and 18, the limit
/// switch at the negative and at the positive end, and 35 and 37, the present position. Whichever the switch,
/// it closes beyond the zero of SimulatedCia402Spec. Homing approaches the switch until it closes, then
/// leaves it slowly until it opens. Real-time: every function (bounded, no allocation).
class SimulatedCia402Motion {
 public:
  /// What decides how the axis moves.
  struct Input {
    const SimulatedObjectDictionary& objects;  // controlword, mode, targets, limits
    bool enabled;                              // the drive is in "operation enabled"
  };

  explicit SimulatedCia402Motion(const SimulatedCia402Spec& spec) noexcept;

  /// Ends homing and forgets violations of limits, as after NMT reset node. The reference stays.
  void reset() noexcept;

  /// Moves the axis up to an instant. @param now_ns  never before an earlier call's
  void advance(const Input& input, int64_t now_ns) noexcept;

  /// Makes the target of `input` the set-point, kept to the soft limits (607D).
  void take_target(const Input& input) noexcept;

  /// Starts or interrupts homing as bit 4 of a new controlword says. @param previous  the controlword before
  void handle_homing_bit(const Input& input, uint16_t previous, uint16_t controlword) noexcept;

  /// Judges the following error; to be called at SYNC.
  /// @return whether it has been beyond its window (6065) for longer than 6066 allows
  bool judge_following_error(const Input& input) noexcept;

  /// The bits of the statusword that tell of motion, limits and reference.
  uint16_t status_bits(const Input& input) const noexcept;

  /// Position actual value (6064), counts.
  int32_t actual_counts() const noexcept;

  /// Torque actual value (6077), thousandths of the rated torque.
  int16_t actual_torque() const noexcept;

  /// Position, counts from the zero of SimulatedCia402Spec, with its fraction; not the value of its encoder.
  double position() const noexcept { return servo_.position(); }

  void set_jammed(bool jammed) noexcept { servo_.set_jammed(jammed); }  ///< As SimulatedServo.
  void set_load(double load) noexcept { servo_.set_load(load); }        ///< As SimulatedServo.

 private:
  enum class Homing : uint8_t { kNone, kApproachingSwitch, kLeavingSwitch, kAttained, kError };

  void search_reference(const Input& input, int64_t now_ns) noexcept;
  void start_homing(const Input& input) noexcept;
  void take_reference(double zero) noexcept;
  bool searches(const Input& input) const noexcept;

  double torque_limit_;           // in rated torques
  double zero_;                   // where its encoder reads 0, counts from the zero of the spec
  SimulatedServo servo_;          // in counts from there
  int64_t now_ns_ = -1;           // -1: before the first call of advance
  bool limited_ = false;          // the target was beyond a soft limit
  bool following_error_ = false;  // the window was left for longer than allowed
  int64_t beyond_since_ns_ = -1;  // out of that window; -1: it is not
  Homing homing_ = Homing::kNone;
  double homing_speed_ = 0;  // counts/s
  bool referenced_;
  uint16_t referenced_mask_;  // of the statusword
};

}  // namespace tendril::hal
