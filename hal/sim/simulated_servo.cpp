// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/simulated_servo.h"

#include <algorithm>

namespace tendril::hal {
namespace {

constexpr double kTick_s = 1e-9 * SimulatedServo::kTick_ns;
constexpr int64_t kMostTicks = 5'000'000'000 / SimulatedServo::kTick_ns;
constexpr double kVelocityGain = 4;  // in position gains: critical damping

}  // namespace

SimulatedServo::SimulatedServo(double top_speed, const ServoTuning& tuning, double position) noexcept
    : top_speed_(top_speed),
      speed_limit_(top_speed),
      tuning_(tuning),
      position_(position),
      set_point_(position),
      goal_(position) {}

void SimulatedServo::advance(int64_t now_ns) noexcept {
  const int64_t ticks = now_ns / kTick_ns;
  if (ticks_ < 0) ticks_ = ticks;
  ticks_ = std::max(ticks_, ticks - kMostTicks);
  while (ticks_ < ticks) tick(++ticks_ * kTick_ns);
  now_ns_ = now_ns;
}

void SimulatedServo::tick(int64_t now_ns) noexcept {
  const double next = set_point(now_ns);
  const double forward = fed_forward_ + (next - set_point_) / kTick_s;
  const double demand = forward + tuning_.position_gain * (set_point_ - position_);
  const double speed = std::clamp(demand, -speed_limit_, speed_limit_);
  set_point_ = next;
  if (locked_ || jammed_) {
    velocity_ = acceleration_ = 0;
    return;
  }
  acceleration_ = force_controlled_ ? acceleration_under(force_) : acceleration_towards(speed);
  velocity_ = std::clamp(velocity_ + kTick_s * acceleration_, -top_speed_, top_speed_);
  position_ += kTick_s * velocity_;
  if (force_controlled_) goal_ = set_point_ = position_;
}

double SimulatedServo::acceleration_towards(double speed) const noexcept {
  const double wanted = kVelocityGain * tuning_.position_gain * (speed - velocity_);
  const double most = top_speed_ / tuning_.acceleration_time;
  const double driven = velocity_ / top_speed_;
  const double up = 1 + std::max(0.0, -driven) - load_, down = -1 - std::max(0.0, driven) - load_;
  return std::clamp(wanted, most * std::clamp(down, -1.0, 1.0), most * std::clamp(up, -1.0, 1.0));
}

/// Above the speed limit the motor brakes with the force that this needs, up to its force limit.
double SimulatedServo::acceleration_under(double force) const noexcept {
  const double most = top_speed_ / tuning_.acceleration_time, resistance = load_ + friction();
  const double wanted =
      std::clamp(most * (force - resistance), (-speed_limit_ - velocity_) / tuning_.acceleration_time,
                 (speed_limit_ - velocity_) / tuning_.acceleration_time);
  return std::clamp(wanted, most * (-1 - resistance), most * (1 - resistance));
}

double SimulatedServo::friction() const noexcept { return tuning_.friction * velocity_ / top_speed_; }

double SimulatedServo::force() const noexcept {
  if (locked_) return 0;
  if (jammed_ && force_controlled_) return force_;
  const double inertial = acceleration_ * tuning_.acceleration_time / top_speed_;
  return std::clamp(load_ + inertial + (force_controlled_ ? friction() : 0), -1.0, 1.0);
}

double SimulatedServo::set_point(int64_t now_ns) const noexcept {
  return now_ns < arrival_ns_ ? goal_ - slope_ * 1e-9 * static_cast<double>(arrival_ns_ - now_ns) : goal_;
}

void SimulatedServo::lock() noexcept {
  locked_ = true;
  velocity_ = acceleration_ = 0;
  pass_through(position_, 0);
}

void SimulatedServo::interpolate(double goal, int64_t duration_ns) noexcept {
  slope_ = (goal - set_point(now_ns_)) / (1e-9 * static_cast<double>(duration_ns));
  goal_ = goal;
  fed_forward_ = 0;
  force_controlled_ = false;
  arrival_ns_ = now_ns_ + duration_ns;
}

void SimulatedServo::pass_through(double goal, double rate) noexcept {
  goal_ = set_point_ = goal;
  fed_forward_ = rate;
  force_controlled_ = false;
  arrival_ns_ = now_ns_;
}

void SimulatedServo::apply_force(double force) noexcept {
  pass_through(position_, 0);
  force_controlled_ = true;
  force_ = std::clamp(force, -1.0, 1.0);
}

void SimulatedServo::limit_speed(double speed) noexcept {
  speed_limit_ = std::max(0.0, std::min(top_speed_, speed));
}

}  // namespace tendril::hal
