#pragma once

#include <cstdint>
#include <vector>

#include "app/config/config.h"
#include "rt/channels.h"
#include "rt/target.h"

namespace tendril::app {

/// The goal that a waypoint stands for: the controlled coordinates of the effector that moves are the
/// waypoint's, all others are at rest.
/// @param rest  all controlled coordinates, e, m or m³
rt::EffectorVector goal_at(const Config& config, const Eigen::Vector3d& waypoint,
                           const rt::EffectorVector& rest);

/// The path of the effectors in time: a straight approach from where they are to the first waypoint, then
/// from waypoint to waypoint at constant speed; a closed path goes round for ever, an open one ends at its
/// last waypoint. The waypoints are one effector's; the coordinates of the others go to rest on the approach
/// and stay there.
class Motion {
 public:
  /// @param rest   where the coordinates of the other effectors stay, e, m or m³
  /// @param start  when the approach begins, and from where
  Motion(const Config& config, const rt::EffectorVector& rest, const rt::RunStart& start);

  /// The straight piece of the path at an instant, stamped with it.
  rt::Target at(int64_t now_ns) const;

  /// When the first waypoint is reached and the path proper begins.
  int64_t path_start_ns() const { return path_start_ns_; }

 private:
  struct Leg {
    rt::EffectorVector from, to;
    int64_t duration_ns;
  };

  Leg leg(const rt::EffectorVector& from, const rt::EffectorVector& to) const;

  double speed_;                  // m/s
  rt::EffectorVector positions_;  // 1 for coordinates that are positions, 0 for volumes
  bool closed_;
  Leg approach_;
  std::vector<Leg> path_;
  int64_t start_ns_, path_start_ns_, round_ns_ = 0;
};

}  // namespace tendril::app
