// SPDX-License-Identifier: Apache-2.0
#include "app/robot/curve_path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tendril::app {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
// Where the greatest derivatives are looked for, and what may lie between two such angles.
constexpr int kLooks = 4096;
constexpr double kBetween = 1.001;
// A curve without a jerk of its own runs on for so long if no other target comes.
constexpr double kOn_s = 1;

rt::EffectorVector scalar(double value) { return rt::EffectorVector::Constant(1, value); }

}  // namespace

CurvePath::CurvePath(const CurveConfig& curve, std::optional<int> turns, double speed,
                     const std::optional<MotionLimits>& limits)
    : curve_(curve),
      end_(turns ? *turns * kTurn : std::numeric_limits<double>::infinity()),
      rate_(speed / greatest(1)),
      angle_(scalar(0)) {
  if (!limits) return;
  const double slope = greatest(1), bend = greatest(2), twist = greatest(3);
  // |a| ≤ slope |φ̈| + bend φ̇² and |j| ≤ slope |φ⃛| + 3 bend |φ̇ φ̈| + twist |φ̇|³: each term gets its share.
  const double A = limits->acceleration, J = limits->jerk;
  rate_ = std::min({rate_, std::sqrt(A / 2 / bend), std::cbrt(J / 3 / twist)});
  const MotionLimits of_angle{rate_, std::min(A / 2 / slope, J / 9 / (bend * rate_)), J / 3 / slope};
  if (turns)
    angle_ = rest_to_rest(scalar(0), scalar(end_), end_, of_angle);
  else
    angle_.ramp(scalar(rate_), rate_, of_angle);
}

double CurvePath::round_s() const {
  const double duration_s = angle_.duration_s(), angle = angle_.end()[0];
  return duration_s + std::max(0.0, (std::isfinite(end_) ? end_ : kTurn) - angle) / rate_;
}

Eigen::Vector3d CurvePath::derivative(int order, double angle) const {
  const Eigen::Array3d n = curve_.frequency.array();
  return curve_.amplitude.array() * n.pow(order) *
         (n * angle + curve_.phase.array() + order * std::numbers::pi / 2).sin();
}

double CurvePath::greatest(int order) const {
  double result = 0;
  for (int k = 0; k < kLooks; ++k) result = std::max(result, derivative(order, kTurn * k / kLooks).norm());
  return kBetween * result;
}

MotionProfile::State CurvePath::at(double t_s) const {
  const double evenly_s = t_s - angle_.duration_s();
  MotionProfile::State turned = angle_.at(t_s);
  if (evenly_s >= 0 && angle_.end()[0] < end_) {
    turned.position[0] += rate_ * evenly_s;
    turned.velocity[0] = rate_;
    if (turned.position[0] >= end_) turned.position[0] = end_, turned.velocity[0] = 0;
  }
  const double rate = turned.velocity[0], phi = std::fmod(turned.position[0], kTurn);
  MotionProfile::State state;
  state.position = derivative(0, phi);
  state.velocity = rate * derivative(1, phi);
  state.acceleration = rate * rate * derivative(2, phi) + turned.acceleration[0] * derivative(1, phi);
  state.left_s = turned.position[0] < end_ ? kOn_s : 0;
  state.jerk_free = false;
  state.label = (static_cast<std::size_t>(phi / kTurn * kWaypointsOfCurve) + 1) % kWaypointsOfCurve;
  return state;
}

}  // namespace tendril::app
