#include "app/operation/target_source.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tendril::app {

TargetSource::TargetSource(const Config& config, rt::EffectorVector rest)
    : config_(config), rest_(std::move(rest)) {}

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
      return path_target(now_ns);
    case Mode::kTarget:
    case Mode::kHold:
      break;
  }
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
  mode_ = Mode::kTarget;
  undisturbed_ = false;
}

void TargetSource::hold(int64_t now_ns) {
  if (mode_ != Mode::kNone) stay(now_ns);
}

void TargetSource::stay(int64_t now_ns) {
  const rt::EffectorVector here = wanted(now_ns);
  aim(now_ns, here, 0, rt::EffectorVector::Zero(here.size()));
  mode_ = Mode::kHold;
}

int64_t TargetSource::path_time_ns(int64_t now_ns) const {
  return path_ns_ + std::llround(clock_rate_ * static_cast<double>(now_ns - clock_ns_));
}

/// The piece of the path at its own time, told in ours.
rt::Target TargetSource::path_target(int64_t now_ns) const {
  rt::Target target = path_->at(path_time_ns(now_ns));
  const auto left_ns = static_cast<double>(target.until_ns - target.stamp_ns);
  target.stamp_ns = target.until_ns = now_ns;
  target.velocity *= clock_rate_;
  if (clock_rate_ > 0) target.until_ns += std::llround(left_ns / clock_rate_);
  return target;
}

void TargetSource::set_path_clock(int64_t now_ns, double rate) {
  path_ns_ = path_time_ns(now_ns);
  clock_ns_ = now_ns;
  if (std::exchange(clock_rate_, rate) != rate) undisturbed_ = false;
}

void TargetSource::follow_path(int64_t now_ns) {
  path_.emplace(config_, rest_, rt::RunStart{now_ns, wanted(now_ns)});
  clock_ns_ = path_ns_ = now_ns;
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
