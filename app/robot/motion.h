// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "app/config/config.h"
#include "app/robot/motion_profile.h"
#include "rt/channels.h"
#include "rt/target.h"

namespace tendril::app {

/// The goal that a waypoint stands for: the controlled coordinates of the effector that moves are the
/// waypoint's, all others are at rest.
/// @param rest  all controlled coordinates, e, m or m³
rt::EffectorVector goal_at(const Config& config, const Eigen::Vector3d& waypoint,
                           const rt::EffectorVector& rest);

/// Which part of a path: the way to a waypoint.
struct PathPart {
  std::size_t to = 0;     ///< the waypoint it leads to
  bool approach = false;  ///< from where the effectors were; else from the waypoint before
};

/// The limits of the file's motion; none where it has no acceleration, so that targets move at constant
/// speed.
std::optional<MotionLimits> motion_limits(const Config& config);

/// The target that a state of a motion profile stands for at an instant. It runs on with constant
/// acceleration, but no longer than that is near the profile.
rt::Target target_of(const MotionProfile::State& state, int64_t now_ns);

/// The path of the effectors in time: a straight approach from where they are to the first waypoint, then
/// from waypoint to waypoint; a closed path goes round for ever, an open one ends at its last waypoint. The
/// speed is constant, or, where the file limits acceleration and jerk, within these limits, from rest on. A
/// curve may take the place of waypoints. The
/// waypoints are one effector's; the coordinates of the others go to rest on the approach and stay there.
class Motion {
 public:
  /// @param rest   where the coordinates of the other effectors stay, e, m or m³
  /// @param start  when the approach begins, and from where
  Motion(const Config& config, const rt::EffectorVector& rest, const rt::RunStart& start);

  /// The piece of the path at an instant, stamped with it: straight, or of constant acceleration.
  rt::Target at(int64_t now_ns) const;

  /// When the first waypoint is reached and the path proper begins.
  int64_t path_start_ns() const { return path_start_ns_; }

  /// How long after path_start_ns() all of the path has been passed: an open one to its end, a closed one as
  /// it repeats itself.
  int64_t round_ns() const { return round_ns_; }

  /// The part of the path that is valid at an instant.
  PathPart part(int64_t now_ns) const;

 private:
  struct Leg {
    rt::EffectorVector from, to;
    int64_t duration_ns;
  };

  /// A path within limits, by seconds since its beginning.
  struct Smooth {
    MotionProfile approach;
    std::function<MotionProfile::State(double)> path;
  };

  struct Place {
    const Leg* leg;
    int64_t since_ns;  // of its beginning
  };

  void go_at_constant_speed(const rt::EffectorVector& from, const std::vector<rt::EffectorVector>& waypoints);
  void go_within(const MotionLimits& limits, double corners, const rt::EffectorVector& from,
                 const std::vector<rt::EffectorVector>& waypoints);
  void go_round(const Config& config, const rt::EffectorVector& rest, const rt::EffectorVector& from);
  MotionProfile::State smooth_state(int64_t now_ns) const;
  Leg leg(const rt::EffectorVector& from, const rt::EffectorVector& to) const;
  Place place(int64_t now_ns) const;

  double speed_;                  // m/s
  rt::EffectorVector positions_;  // 1 for coordinates that are positions, 0 for volumes
  bool closed_;
  std::size_t count_ = 0;         // of the file's waypoints
  std::optional<Smooth> smooth_;  // else legs of constant speed
  Leg approach_;
  std::vector<Leg> path_;
  int64_t start_ns_, path_start_ns_, round_ns_ = 0;
};

}  // namespace tendril::app
