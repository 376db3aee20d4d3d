// SPDX-License-Identifier: Apache-2.0
#include "app/operation/target_source.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/robot/robot.h"

namespace tendril::app {
namespace {

// A target on a path whose clock changes its rate runs on for no longer than this if the next one does not
// come.
constexpr int64_t kExtrapolated_ns = 50'000'000;

}  // namespace

TargetSource::TargetSource(const Config& config, rt::EffectorVector rest)
    : config_(config), limits_(motion_limits(config)), rest_(std::move(rest)) {
  const auto rows = effector_rows(config);
  positions_.resize(rest_.size());
  for (std::size_t k = 0; k < rows.size(); ++k)
    positions_[static_cast<Eigen::Index>(k)] = rows[k].is_position() ? 1 : 0;
}

void TargetSource::begin(const rt::RunStart& start) {
  begun_ = true;
  start_ = start.p_e;
  if (again_) return stay(start.stamp_ns);
  if (!config_.motion) return;
  path_.emplace(config_, rest_, start);
  mode_ = Mode::kPath;
  clock_ns_ = path_ns_ = start.stamp_ns;
}

void TargetSource::end() {
  begun_ = false;
  again_ = true;
  undisturbed_ = false;
  mode_ = Mode::kNone;
}

std::optional<rt::Target> TargetSource::at(int64_t now_ns) const {
  switch (mode_) {
    case Mode::kNone:
      return std::nullopt;
    case Mode::kPath:
    case Mode::kPaused:
      if (profile_ && now_ns < clock_ns_) break;  // not yet at rest to begin it
      return path_target(now_ns);
    case Mode::kTarget:
    case Mode::kHold:
      break;
  }
  if (profile_) return target_of(profile_->at(1e-9 * static_cast<double>(now_ns - profile_ns_)), now_ns);
  rt::Target target = now_ns < to_goal_.until_ns ? to_goal_ : beyond_;
  target.position = target.at(now_ns);
  target.stamp_ns = now_ns;
  target.until_ns = std::max(target.until_ns, now_ns);
  return target;
}

rt::EffectorVector TargetSource::wanted(int64_t now_ns) const {
  const auto target = at(now_ns);
  return target ? target->position : start_;
}

void TargetSource::aim(int64_t now_ns, const rt::EffectorVector& goal, int64_t duration_ns,
                       const rt::EffectorVector& velocity) {
  to_goal_.position = wanted(now_ns);
  to_goal_.velocity =
      (goal - to_goal_.position) / (1e-9 * static_cast<double>(std::max<int64_t>(duration_ns, 1)));
  to_goal_.stamp_ns = now_ns;
  to_goal_.until_ns = now_ns + duration_ns;
  beyond_ = {goal, velocity, to_goal_.until_ns,
             to_goal_.until_ns + std::llround(1e9 * config_.control.target_age_limit)};
  profile_.reset();
  mode_ = Mode::kTarget;
  undisturbed_ = false;
}

double TargetSource::distance(const rt::EffectorVector& a, const rt::EffectorVector& b) const {
  return (b - a).cwiseProduct(positions_).norm();
}

MotionProfile TargetSource::coming_to_rest(int64_t now_ns) const {
  const rt::EffectorVector none = 0 * positions_;
  MotionProfile::State motion{wanted(now_ns), none, none};
  if (const auto target = at(now_ns); target && target->until_ns > now_ns) {
    motion.velocity = target->velocity;
    if (target->acceleration.size() > 0) motion.acceleration = target->acceleration;
  }
  return MotionProfile(motion, none, positions_, *limits_);
}

void TargetSource::go(int64_t now_ns, const rt::EffectorVector& goal, double speed) {
  if (!limits_) {
    const double seconds = distance(wanted(now_ns), goal) / speed;
    return aim(now_ns, goal, std::llround(1e9 * seconds), 0 * goal);
  }
  MotionProfile profile = coming_to_rest(now_ns);
  profile.go_to(goal, distance(profile.end(), goal), {speed, limits_->acceleration, limits_->jerk});
  profile_ = std::move(profile);
  profile_ns_ = now_ns;
  mode_ = Mode::kTarget;
  undisturbed_ = false;
}

void TargetSource::hold(int64_t now_ns) {
  if (mode_ == Mode::kNone) return;
  if (limits_) {
    profile_ = coming_to_rest(now_ns);
    profile_ns_ = now_ns;
    mode_ = Mode::kHold;
    undisturbed_ = false;
    return;
  }
  stay(now_ns);
}

void TargetSource::stay(int64_t now_ns) {
  const rt::EffectorVector here = wanted(now_ns);
  aim(now_ns, here, 0, rt::EffectorVector::Zero(here.size()));
  mode_ = Mode::kHold;
}

TargetSource::PathClock TargetSource::path_clock(int64_t now_ns) const {
  double since_s = 1e-9 * static_cast<double>(now_ns - clock_ns_);
  int64_t path_ns = path_ns_;
  if (clock_) {
    const MotionProfile::State clock = clock_->at(since_s);
    path_ns += std::llround(1e9 * clock.position[0]);
    since_s -= clock_->duration_s();
    if (since_s < 0) return {path_ns, clock.velocity[0], clock.acceleration[0]};
    return {path_ns + std::llround(1e9 * clock_rate_ * since_s), clock_rate_, 0};
  }
  return {path_ns + std::llround(clock_rate_ * static_cast<double>(now_ns - clock_ns_)), clock_rate_, 0};
}

/// The piece of the path at its own time, told in ours.
rt::Target TargetSource::path_target(int64_t now_ns) const {
  const PathClock clock = path_clock(now_ns);
  rt::Target target = path_->at(clock.path_ns);
  const auto left_ns = static_cast<double>(target.until_ns - target.stamp_ns);
  target.stamp_ns = target.until_ns = now_ns;
  if (target.acceleration.size() > 0)
    target.acceleration = clock.rate * clock.rate * target.acceleration + clock.change * target.velocity;
  target.velocity *= clock.rate;
  if (clock.change != 0)
    target.until_ns += kExtrapolated_ns;
  else if (clock.rate > 0)
    target.until_ns += std::llround(left_ns / clock.rate);
  return target;
}

/// Within limits the rate of the clock changes along a ramp of its own: on a straight piece of path the
/// target then keeps to the limits.
void TargetSource::set_path_clock(int64_t now_ns, double rate) {
  if (limits_ && now_ns < clock_ns_) {  // at rest before the path begins: no ramp is needed
    clock_rate_ = rate;
    return;
  }
  const PathClock clock = path_clock(now_ns);
  path_ns_ = clock.path_ns;
  clock_ns_ = now_ns;
  if (limits_) {
    const auto scalar = [](double value) { return rt::EffectorVector::Constant(1, value); };
    const double speed = limits_->speed;
    clock_ = MotionProfile({scalar(0), scalar(clock.rate), scalar(clock.change)}, scalar(rate), scalar(1),
                           {1, limits_->acceleration / speed, limits_->jerk / speed});
  }
  if (std::exchange(clock_rate_, rate) != rate) undisturbed_ = false;
}

void TargetSource::follow_path(int64_t now_ns) {
  rt::RunStart start{now_ns, wanted(now_ns)};
  if (limits_) {
    profile_ = coming_to_rest(now_ns);
    profile_ns_ = now_ns;
    start = {now_ns + std::llround(1e9 * profile_->duration_s()), profile_->end()};
  }
  path_.emplace(config_, rest_, start);
  clock_.reset();
  clock_ns_ = path_ns_ = start.stamp_ns;
  clock_rate_ = path_rate_;
  mode_ = Mode::kPath;
  undisturbed_ = false;
}

void TargetSource::pause(int64_t now_ns) {
  if (mode_ != Mode::kPath) {
    if (mode_ != Mode::kPaused) hold(now_ns);
    return;
  }
  set_path_clock(now_ns, 0);
  mode_ = Mode::kPaused;
}

void TargetSource::resume(int64_t now_ns) {
  if (mode_ != Mode::kPaused) return;
  set_path_clock(now_ns, path_rate_);
  mode_ = Mode::kPath;
}

void TargetSource::set_path_rate(int64_t now_ns, double rate) {
  path_rate_ = rate;
  if (mode_ == Mode::kPath) set_path_clock(now_ns, rate);
}

const char* name(TargetSource::Mode mode) {
  switch (mode) {
    case TargetSource::Mode::kNone:
      return "none";
    case TargetSource::Mode::kPath:
      return "path";
    case TargetSource::Mode::kPaused:
      return "paused";
    case TargetSource::Mode::kTarget:
      return "target";
    case TargetSource::Mode::kHold:
      return "hold";
  }
  return "";
}

}  // namespace tendril::app
