#include "app/robot/motion.h"

#include <cmath>

#include "app/robot/robot.h"

namespace tendril::app {

rt::EffectorVector goal_at(const Config& config, const Eigen::Vector3d& waypoint,
                           const rt::EffectorVector& rest) {
  const auto rows = effector_rows(config);
  rt::EffectorVector goal = rest;
  for (size_t r = 0; r < rows.size(); ++r)
    if (rows[r].effector == config.motion->effector)
      goal[r] = config.motion->origin[rows[r].axis] + waypoint[rows[r].axis];
  return goal;
}

Motion::Motion(const Config& config, const rt::EffectorVector& rest, const rt::RunStart& start)
    : speed_(config.motion->speed), closed_(config.motion->closed), start_ns_(start.stamp_ns) {
  const auto rows = effector_rows(config);
  positions_.resize(rest.size());
  for (size_t r = 0; r < rows.size(); ++r) positions_[r] = rows[r].is_position() ? 1 : 0;
  std::vector<rt::EffectorVector> waypoints;
  for (const Eigen::Vector3d& waypoint : config.motion->waypoints)
    waypoints.push_back(goal_at(config, waypoint, rest));
  approach_ = leg(start.p_e, waypoints.front());
  path_start_ns_ = start_ns_ + approach_.duration_ns;
  for (size_t k = 1; k < waypoints.size(); ++k) path_.push_back(leg(waypoints[k - 1], waypoints[k]));
  if (closed_ || path_.empty()) path_.push_back(leg(waypoints.back(), waypoints.front()));
  for (const Leg& part : path_) round_ns_ += part.duration_ns;
}

Motion::Leg Motion::leg(const rt::EffectorVector& from, const rt::EffectorVector& to) const {
  return {from, to, std::llround(1e9 * (to - from).cwiseProduct(positions_).norm() / speed_)};
}

rt::Target Motion::at(int64_t now_ns) const {
  const Leg* part = &approach_;
  int64_t since_ns = std::max<int64_t>(0, now_ns - start_ns_);
  if (now_ns >= path_start_ns_) {
    since_ns = now_ns - path_start_ns_;
    if (closed_ && round_ns_ > 0) since_ns %= round_ns_;
    part = &path_.front();
    while (since_ns >= part->duration_ns && part != &path_.back()) since_ns -= (part++)->duration_ns;
  }
  rt::Target target;
  const double duration_s = 1e-9 * static_cast<double>(std::max<int64_t>(part->duration_ns, 1));
  target.velocity = (part->to - part->from) / duration_s;
  const int64_t within_ns = std::min(since_ns, part->duration_ns);
  target.position = part->from + target.velocity * (1e-9 * static_cast<double>(within_ns));
  target.stamp_ns = now_ns;
  target.until_ns = now_ns + part->duration_ns - within_ns;
  return target;
}

}  // namespace tendril::app
