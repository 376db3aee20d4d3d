// SPDX-License-Identifier: Apache-2.0
#include "app/robot/motion_profile.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tendril::app {

double ramp_time(double step, const MotionLimits& limits) {
  const double A = limits.acceleration, J = limits.jerk;
  return step * J >= A * A ? step / A + A / J : 2 * std::sqrt(step / J);
}

double ramp_distance(double v0, double v1, const MotionLimits& limits) {
  return (v0 + v1) / 2 * ramp_time(std::abs(v1 - v0), limits);  // a ramp is symmetric
}

MotionProfile::MotionProfile(rt::EffectorVector start) {
  const auto e = start.size();
  here_.position = std::move(start);
  here_.velocity.setZero(e);
  here_.acceleration.setZero(e);
}

MotionProfile::MotionProfile(const State& motion, const rt::EffectorVector& velocity,
                             const rt::EffectorVector& positions, const MotionLimits& limits)
    : here_(motion) {
  const double acceleration = motion.acceleration.cwiseProduct(positions).norm();
  if (acceleration > 0)
    add(acceleration / limits.jerk, motion.acceleration, -limits.jerk / acceleration * motion.acceleration);
  here_.acceleration.setZero();
  here_.left_s = 0;
  here_.jerk_free = true;
  ramp(velocity, (velocity - here_.velocity).cwiseProduct(positions).norm(), limits);
}

void MotionProfile::add(double seconds, const rt::EffectorVector& acceleration,
                        const rt::EffectorVector& jerk) {
  if (seconds <= 0) return;
  const double t = seconds;
  pieces_.push_back({end_s_, here_.position, here_.velocity, acceleration, jerk, label_});
  here_.position += t * (here_.velocity + t / 2 * (acceleration + t / 3 * jerk));
  here_.velocity += t * (acceleration + t / 2 * jerk);
  end_s_ += t;
}

void MotionProfile::ramp(const rt::EffectorVector& velocity, double step, const MotionLimits& limits) {
  if (step > 0) {
    const rt::EffectorVector along = (velocity - here_.velocity) / step;
    const double T = ramp_time(step, limits), rise = std::min(limits.acceleration / limits.jerk, T / 2);
    const rt::EffectorVector jerk = limits.jerk * along, top = rise * jerk, none = 0 * along;
    add(rise, none, jerk);
    add(T - 2 * rise, top, none);
    add(rise, top, -jerk);
  }
  here_.velocity = velocity;
}

void MotionProfile::cruise(double seconds) {
  const rt::EffectorVector none = rt::EffectorVector::Zero(here_.position.size());
  add(seconds, none, none);
}

void MotionProfile::straight(const rt::EffectorVector& direction, double length, double v0, double v1,
                             const MotionLimits& limits) {
  const auto ramps = [&](double top) {
    return ramp_distance(v0, top, limits) + ramp_distance(top, v1, limits);
  };
  double low = std::max(v0, v1), top = limits.speed;
  if (ramps(top) > length) {
    for (double middle = (low + top) / 2; low < middle && middle < top; middle = (low + top) / 2)
      (ramps(middle) > length ? top : low) = middle;
    top = low;
  }
  ramp(top * direction, top - v0, limits);
  if (top > 0) cruise((length - ramps(top)) / top);
  ramp(v1 * direction, top - v1, limits);
}

void MotionProfile::go_to(const rt::EffectorVector& goal, double distance, const MotionLimits& limits) {
  if (distance > 0) straight((goal - here_.position) / distance, distance, 0, 0, limits);
  end_at(goal);
}

MotionProfile::State MotionProfile::at(double t_s) const {
  if (pieces_.empty() || t_s >= end_s_) {
    State end = here_;
    end.label = label_;
    return end;
  }
  const double t_in = std::max(t_s, 0.0);
  const auto after = std::ranges::upper_bound(pieces_, t_in, {}, &Piece::begin_s);
  const Piece& piece = *std::prev(after);
  const double t = t_in - piece.begin_s;
  State state;
  state.position = piece.position + t * (piece.velocity + t / 2 * (piece.acceleration + t / 3 * piece.jerk));
  state.velocity = piece.velocity + t * (piece.acceleration + t / 2 * piece.jerk);
  state.acceleration = piece.acceleration + t * piece.jerk;
  state.left_s = (after == pieces_.end() ? end_s_ : after->begin_s) - t_in;
  state.jerk_free = piece.jerk.isZero(0);
  state.label = piece.label;
  return state;
}

MotionProfile rest_to_rest(const rt::EffectorVector& from, const rt::EffectorVector& to, double distance,
                           const MotionLimits& limits) {
  MotionProfile profile(from);
  profile.go_to(to, distance, limits);
  return profile;
}

MotionProfile at_constant_speed(const rt::EffectorVector& from, const rt::EffectorVector& to, double distance,
                                double speed) {
  constexpr MotionLimits kNone{1, 1, 1};  // a change without a size takes no time
  MotionProfile profile(from);
  if (distance > 0) {
    profile.ramp(speed / distance * (to - from), 0, kNone);
    profile.cruise(distance / speed);
    profile.ramp(0 * from, 0, kNone);
  }
  profile.end_at(to);
  return profile;
}

}  // namespace tendril::app
