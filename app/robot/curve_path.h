// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "app/config/config.h"
#include "app/robot/motion_profile.h"

namespace tendril::app {

/// A curve passed in time, for ever or so many turns. Its angle φ is led from rest, and to rest if it ends,
/// so slowly that speed, acceleration and jerk stay within their limits; without limits of the latter two it
/// turns evenly. Real-time: no.
class CurvePath {
 public:
  /// @param speed  the greatest along the curve, m/s
  CurvePath(const CurveConfig& curve, std::optional<int> turns, double speed,
            const std::optional<MotionLimits>& limits);

  /// What the first turn takes, or all of them where they end, s.
  double round_s() const;

  /// Position, velocity and acceleration in space, 3, from the centre of the curve. The label is the
  /// waypoint, of those of MotionConfig, that comes next.
  MotionProfile::State at(double t_s) const;

 private:
  Eigen::Vector3d derivative(int order, double angle) const;
  double greatest(int order) const;

  CurveConfig curve_;
  double end_;           // φ where it ends, rad; may be infinite
  double rate_;          // φ̇ of even turning, rad/s
  MotionProfile angle_;  // φ while its rate changes; all of it where it ends at rest
};

}  // namespace tendril::app
