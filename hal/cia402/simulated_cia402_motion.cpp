// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/simulated_cia402_motion.h"

#include <algorithm>
#include <cmath>

namespace tendril::hal {
namespace {

using Entry = SimulatedEntry;
using Input = SimulatedCia402Motion::Input;

constexpr int64_t kErrorTimeUnit_ns = 1'000'000;  // of 6066
constexpr int64_t kSecond_ns = 1'000'000'000;

bool is_in_mode(const Input& input, int8_t mode) noexcept {
  return input.enabled && input.objects.signed_value(Entry::kModeDisplay) == mode;
}

bool is_halted(const Input& input) noexcept { return (input.objects[Entry::kControlword] & kHalt) != 0; }

bool follows_position(const Input& input) noexcept {
  return is_in_mode(input, kModeCyclicPosition) && !is_halted(input);
}

bool follows_torque(const Input& input) noexcept {
  return is_in_mode(input, kModeCyclicTorque) && !is_halted(input);
}

int64_t interpolation_ns(const SimulatedObjectDictionary& objects) noexcept {
  const InterpolationPeriod period{static_cast<uint8_t>(objects[Entry::kPeriodValue]),
                                   static_cast<int8_t>(objects.signed_value(Entry::kPeriodExponent))};
  return period.nanoseconds();
}

}  // namespace

SimulatedCia402Motion::SimulatedCia402Motion(const SimulatedCia402Spec& spec) noexcept
    : torque_limit_(spec.torque_limit),
      zero_(spec.incremental ? spec.position_counts : 0),
      servo_(spec.top_speed, spec.tuning, spec.position_counts),
      referenced_(!spec.incremental),
      referenced_mask_(static_cast<uint16_t>(spec.referenced_bit < 0 ? 0 : 1u << spec.referenced_bit)) {}

void SimulatedCia402Motion::reset() noexcept {
  homing_ = Homing::kNone;
  limited_ = following_error_ = false;
}

void SimulatedCia402Motion::advance(const Input& input, int64_t now_ns) noexcept {
  if (now_ns_ < 0) now_ns_ = now_ns;
  search_reference(input, now_ns);
  now_ns_ = now_ns;
  if (!follows_position(input) && !follows_torque(input) && !searches(input)) servo_.lock();
  servo_.advance(now_ns);
}

void SimulatedCia402Motion::take_target(const Input& input) noexcept {
  const SimulatedObjectDictionary& objects = input.objects;
  if (follows_torque(input)) {
    servo_.unlock();
    const int torque =
        objects.signed_value(Entry::kTargetTorque) + objects.signed_value(Entry::kTorqueOffset);
    servo_.apply_force(torque / (1e3 * torque_limit_));
  }
  if (!follows_position(input)) return;
  double target = objects.signed_value(Entry::kTargetPosition);
  target += objects.signed_value(Entry::kPositionOffset);
  const int32_t min = objects.signed_value(Entry::kLimitMin), max = objects.signed_value(Entry::kLimitMax);
  limited_ = min < max && (target < min || target > max);
  if (limited_) target = std::clamp<double>(target, min, max);
  servo_.unlock();
  servo_.interpolate(zero_ + target, interpolation_ns(objects));
}

void SimulatedCia402Motion::handle_homing_bit(const Input& input, uint16_t previous,
                                              uint16_t controlword) noexcept {
  const bool set = (controlword & kStartHoming) != 0, was_set = (previous & kStartHoming) != 0;
  if (set && !was_set && is_in_mode(input, kModeHoming)) start_homing(input);
  if (!set && homing_ != Homing::kAttained) homing_ = Homing::kNone;  // interrupted
}

bool SimulatedCia402Motion::judge_following_error(const Input& input) noexcept {
  const uint32_t window = input.objects[Entry::kErrorWindow];
  const bool beyond =
      follows_position(input) && window != 0xFFFF'FFFF && std::abs(servo_.following_error()) > window;
  if (!beyond) beyond_since_ns_ = -1;
  if (beyond && beyond_since_ns_ < 0) beyond_since_ns_ = now_ns_;
  following_error_ =
      beyond && now_ns_ - beyond_since_ns_ >= input.objects[Entry::kErrorTime] * kErrorTimeUnit_ns;
  return following_error_;
}

/// Homing without a method is an error [CiA 402-2, object 6098 = 0].
void SimulatedCia402Motion::start_homing(const Input& input) noexcept {
  const int method = input.objects.signed_value(Entry::kHomingMethod);
  homing_speed_ = 0;
  homing_ = method == 0 ? Homing::kError : Homing::kApproachingSwitch;
  if (homes_in_place(method)) take_reference(position());
}

/// Sets the speed of homing from the last instant to `now_ns`. Without power and in another mode the search
/// ends.
void SimulatedCia402Motion::search_reference(const Input& input, int64_t now_ns) noexcept {
  if (!is_in_mode(input, kModeHoming) && homing_ != Homing::kAttained) homing_ = Homing::kNone;
  if (!searches(input)) homing_speed_ = 0;
  if (!searches(input)) return;
  const SimulatedObjectDictionary& objects = input.objects;
  const double outwards = objects.signed_value(Entry::kHomingMethod) == kHomingToNegativeSwitch ? -1 : 1;
  const bool closed = outwards * position() >= 0;
  if (homing_ == Homing::kApproachingSwitch && closed) homing_ = Homing::kLeavingSwitch;
  if (homing_ == Homing::kLeavingSwitch && !closed) return take_reference(0);
  const double wanted = homing_ == Homing::kApproachingSwitch ? outwards * objects[Entry::kSearchSpeed]
                                                              : -outwards * objects[Entry::kZeroSpeed];
  const double dt = static_cast<double>(now_ns - now_ns_) * 1e-9;
  const double change = objects[Entry::kHomingAcceleration] * dt;
  homing_speed_ += std::clamp(wanted - homing_speed_, -change, change);
  servo_.unlock();
  servo_.interpolate(servo_.set_point() + homing_speed_, kSecond_ns);
}

/// @param zero  where the encoder shall read 0, counts from the zero of the spec
void SimulatedCia402Motion::take_reference(double zero) noexcept {
  zero_ = zero;
  homing_ = Homing::kAttained;
  referenced_ = true;
}

bool SimulatedCia402Motion::searches(const Input& input) const noexcept {
  return is_in_mode(input, kModeHoming) && !is_halted(input) &&
         (homing_ == Homing::kApproachingSwitch || homing_ == Homing::kLeavingSwitch);
}

uint16_t SimulatedCia402Motion::status_bits(const Input& input) const noexcept {
  uint16_t bits = 0;
  const bool homes = is_in_mode(input, kModeHoming);
  if (follows_position(input) || follows_torque(input)) bits |= kFollowsCommand;
  if (follows_position(input) && limited_) bits |= kInternalLimit;
  if (following_error_) bits |= kFollowingError;
  if (homes && !searches(input)) bits |= kTargetReached;
  if (homes && homing_ == Homing::kAttained) bits |= kHomingAttained;
  if (homes && homing_ == Homing::kError) bits |= kHomingError;
  if (referenced_) bits |= referenced_mask_;
  return bits;
}

int32_t SimulatedCia402Motion::actual_counts() const noexcept {
  return static_cast<int32_t>(
      std::clamp(std::round(position() - zero_), double{INT32_MIN}, double{INT32_MAX}));
}

int16_t SimulatedCia402Motion::actual_torque() const noexcept {
  return static_cast<int16_t>(
      std::clamp(std::round(1e3 * torque_limit_ * servo_.force()), double{INT16_MIN}, double{INT16_MAX}));
}

}  // namespace tendril::hal
