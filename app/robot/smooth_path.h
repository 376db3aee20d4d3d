// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "app/robot/motion_profile.h"

namespace tendril::app {

/// A path through waypoints within limits of speed, acceleration and jerk. It begins at rest at the first
/// one; an open path ends at rest at the last one. Labels are the waypoints that its pieces lead to, as
/// indices.
struct SmoothPath {
  MotionProfile begin;  ///< all of an open path; of a closed one what comes before it repeats itself
  std::optional<MotionProfile> round;  ///< of a closed path: once round, from the end of `begin` on
};

/// Straight from waypoint to waypoint; each corner is cut by a curve as fast as limits and corner tolerance
/// allow, or passed from rest to rest where that is sooner done. Between corners the speed is the greatest
/// that the limits allow with those of the two corners.
/// @param waypoints  at least one, e, positions in m; those that repeat the one before them count once
/// @param corners    how far from the waypoints the path may stay, m; 0: it stops at each
/// Real-time: no.
SmoothPath smooth_path(const std::vector<rt::EffectorVector>& waypoints, bool closed, double corners,
                       const MotionLimits& limits);

}  // namespace tendril::app
