#pragma once

#include <cstdint>
#include <vector>

#include "app/config.h"
#include "rt/target.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// The goal that a waypoint stands for: the first effector's controlled coordinates are the waypoint's, all
/// others stay.
/// @param others  all controlled coordinates, e, m
rt::EffectorVector goal_at(const Config& config, const Eigen::Vector3d& waypoint,
                           const rt::EffectorVector& others);

/// The path of the effectors in time: a straight approach from where they are to the first waypoint, then
/// from waypoint to waypoint at constant speed; a closed path goes round for ever, an open one ends at its
/// last waypoint. The waypoints are the first effector's; the coordinates of others stay where they are.
class Motion {
 public:
  /// @param start     all controlled coordinates, e, m
  /// @param start_ns  when the approach begins
  Motion(const Config& config, const rt::EffectorVector& start, std::int64_t start_ns);

  /// The path that begins where the model puts the effectors in a cycle, at its instant.
  Motion(const Config& config, const rt::TraceRecord& cycle);

  /// The straight piece of the path at an instant, stamped with it.
  rt::Target at(std::int64_t now_ns) const;

  /// When the first waypoint is reached and the path proper begins.
  std::int64_t path_start_ns() const { return path_start_ns_; }

 private:
  struct Leg {
    rt::EffectorVector from, to;
    std::int64_t duration_ns;
  };

  Leg leg(const rt::EffectorVector& from, const rt::EffectorVector& to) const;

  double speed_;  // m/s
  bool closed_;
  Leg approach_;
  std::vector<Leg> path_;
  std::int64_t start_ns_, path_start_ns_, round_ns_ = 0;
};

}  // namespace tendril::app
