// SPDX-License-Identifier: Apache-2.0
#include "app/robot/motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/robot/curve_path.h"
#include "app/robot/robot.h"
#include "app/robot/smooth_path.h"

namespace tendril::app {
namespace {

// From acceleration 0 to the greatest, where the file has no jerk.
constexpr double kRiseTime_s = 0.1;
// A target of changing acceleration runs on for no longer than this if the next one does not come.
constexpr double kExtrapolated_s = 0.05;

}  // namespace

rt::EffectorVector goal_at(const Config& config, const Eigen::Vector3d& waypoint,
                           const rt::EffectorVector& rest) {
  const auto rows = effector_rows(config);
  rt::EffectorVector goal = rest;
  for (size_t r = 0; r < rows.size(); ++r)
    if (rows[r].effector == config.motion->effector)
      goal[r] = config.motion->origin[rows[r].axis] + waypoint[rows[r].axis];
  return goal;
}

std::optional<MotionLimits> motion_limits(const Config& config) {
  if (!config.motion || !config.motion->acceleration) return std::nullopt;
  const MotionConfig& motion = *config.motion;
  return MotionLimits{motion.speed, *motion.acceleration,
                      motion.jerk.value_or(*motion.acceleration / kRiseTime_s)};
}

rt::Target target_of(const MotionProfile::State& state, int64_t now_ns) {
  rt::Target target;
  target.position = state.position;
  target.velocity = state.velocity;
  target.acceleration = state.acceleration;
  target.stamp_ns = now_ns;
  const double valid_s = state.jerk_free ? state.left_s : std::min(state.left_s, kExtrapolated_s);
  target.until_ns = now_ns + static_cast<int64_t>(1e9 * valid_s);
  return target;
}

Motion::Motion(const Config& config, const rt::EffectorVector& rest, const rt::RunStart& start)
    : speed_(config.motion->speed), closed_(config.motion->closed), start_ns_(start.stamp_ns) {
  const auto rows = effector_rows(config);
  positions_.resize(rest.size());
  for (size_t r = 0; r < rows.size(); ++r) positions_[r] = rows[r].is_position() ? 1 : 0;
  if (config.motion->curve) {
    go_round(config, rest, start.p_e);
    return;
  }
  std::vector<rt::EffectorVector> waypoints;
  for (const Eigen::Vector3d& waypoint : config.motion->waypoints)
    waypoints.push_back(goal_at(config, waypoint, rest));
  count_ = waypoints.size();
  if (closed_ && config.motion->turns) {  // an open path that passes them so often
    for (std::size_t k = count_; k <= count_ * static_cast<std::size_t>(*config.motion->turns); ++k)
      waypoints.push_back(waypoints[k - count_]);
    closed_ = false;
  }
  if (const auto limits = motion_limits(config))
    go_within(*limits, config.motion->corners, start.p_e, waypoints);
  else
    go_at_constant_speed(start.p_e, waypoints);
}

void Motion::go_at_constant_speed(const rt::EffectorVector& from,
                                  const std::vector<rt::EffectorVector>& waypoints) {
  approach_ = leg(from, waypoints.front());
  path_start_ns_ = start_ns_ + approach_.duration_ns;
  for (size_t k = 1; k < waypoints.size(); ++k) path_.push_back(leg(waypoints[k - 1], waypoints[k]));
  if (closed_ || path_.empty()) path_.push_back(leg(waypoints.back(), waypoints.front()));
  for (const Leg& part : path_) round_ns_ += part.duration_ns;
}

void Motion::go_within(const MotionLimits& limits, double corners, const rt::EffectorVector& from,
                       const std::vector<rt::EffectorVector>& waypoints) {
  const double way = (waypoints.front() - from).cwiseProduct(positions_).norm();
  SmoothPath path = smooth_path(waypoints, closed_, corners, limits);
  double round_s = path.begin.duration_s();
  if (path.round) round_s += path.round->duration_s();
  const auto at = [path = std::move(path)](double t_s) {
    const double beyond_s = t_s - path.begin.duration_s();
    if (!path.round || beyond_s < 0) return path.begin.at(t_s);
    return path.round->at(std::fmod(beyond_s, path.round->duration_s()));
  };
  smooth_ = Smooth{rest_to_rest(from, waypoints.front(), way, limits), at};
  path_start_ns_ = start_ns_ + std::llround(1e9 * smooth_->approach.duration_s());
  round_ns_ = std::llround(1e9 * round_s);
}

void Motion::go_round(const Config& config, const rt::EffectorVector& rest, const rt::EffectorVector& from) {
  const auto limits = motion_limits(config);
  const CurvePath curve(*config.motion->curve, config.motion->turns, speed_, limits);
  const auto at = [curve, rows = effector_rows(config), moving = config.motion->effector,
                   centre = goal_at(config, Eigen::Vector3d::Zero(), rest)](double t_s) {
    const MotionProfile::State in_space = curve.at(t_s);
    MotionProfile::State state = in_space;
    state.position = centre;
    state.velocity = state.acceleration = 0 * centre;
    for (std::size_t r = 0; r < rows.size(); ++r) {
      if (rows[r].effector != moving) continue;
      const auto k = static_cast<Eigen::Index>(r);
      state.position[k] += in_space.position[rows[r].axis];
      state.velocity[k] = in_space.velocity[rows[r].axis];
      state.acceleration[k] = in_space.acceleration[rows[r].axis];
    }
    return state;
  };
  const rt::EffectorVector to = at(0).position;
  const double way = (to - from).cwiseProduct(positions_).norm();
  smooth_ =
      Smooth{limits ? rest_to_rest(from, to, way, *limits) : at_constant_speed(from, to, way, speed_), at};
  count_ = config.motion->waypoints.size();
  path_start_ns_ = start_ns_ + std::llround(1e9 * smooth_->approach.duration_s());
  round_ns_ = std::llround(1e9 * curve.round_s());
}

MotionProfile::State Motion::smooth_state(int64_t now_ns) const {
  if (now_ns < path_start_ns_) return smooth_->approach.at(1e-9 * static_cast<double>(now_ns - start_ns_));
  return smooth_->path(1e-9 * static_cast<double>(now_ns - path_start_ns_));
}

Motion::Leg Motion::leg(const rt::EffectorVector& from, const rt::EffectorVector& to) const {
  return {from, to, std::llround(1e9 * (to - from).cwiseProduct(positions_).norm() / speed_)};
}

Motion::Place Motion::place(int64_t now_ns) const {
  Place result{&approach_, std::max<int64_t>(0, now_ns - start_ns_)};
  if (now_ns < path_start_ns_) return result;
  result.since_ns = now_ns - path_start_ns_;
  if (closed_ && round_ns_ > 0) result.since_ns %= round_ns_;
  result.leg = &path_.front();
  while (result.since_ns >= result.leg->duration_ns && result.leg != &path_.back())
    result.since_ns -= (result.leg++)->duration_ns;
  return result;
}

PathPart Motion::part(int64_t now_ns) const {
  if (smooth_ && now_ns < path_start_ns_) return {0, true};
  if (smooth_) return {smooth_state(now_ns).label % count_, false};
  const Leg* leg = place(now_ns).leg;
  if (leg == &approach_) return {0, true};
  const auto next = static_cast<std::size_t>(leg - path_.data()) + 1;
  return {next % count_, false};
}

rt::Target Motion::at(int64_t now_ns) const {
  if (smooth_) return target_of(smooth_state(now_ns), now_ns);
  const auto [part, since_ns] = place(now_ns);
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
