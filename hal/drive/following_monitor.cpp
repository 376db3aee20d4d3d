// SPDX-License-Identifier: Apache-2.0
#include "hal/drive/following_monitor.h"

#include <cmath>
#include <limits>

#include "hal/drive/formatted.h"

namespace tendril::hal {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// What a drive may lag behind: its position loop with the speed fed forward, and the way over the bus.
constexpr double kLag_s = 0.03;
constexpr double kSlack = 0.01;  // of the range, for what a load bends
// Times the top rate: a cable that slips or is pulled is slower still.
constexpr double kFastest = 10;
// By how many periods the time between two positions may be misjudged.
constexpr int kJitter = 2;

/// A hundredth of the range; without a range what is left is a thousandth of a turn.
double slack(const AxisConfig& axis) noexcept {
  const double range = axis.displacement_max - axis.displacement_min;
  return std::isfinite(range) ? kSlack * range : 1e-3 * axis.scale.displacement_per_turn;
}

}  // namespace

double following_error_limit(const AxisConfig& axis) noexcept {
  if (axis.set_point == SetPoint::kEffort) return kInfinity;
  if (axis.following_error > 0) return axis.following_error;
  return axis.top_rate > 0 ? kLag_s * axis.top_rate + slack(axis) : kInfinity;
}

std::string describe_motion_fault(const AxisConfig& axis, const DriveFault& fault) {
  const std::string wanted = displacement_text(axis, fault.wanted),
                    measured = displacement_text(axis, fault.measured);
  if (fault.kind == FaultKind::kFeedbackJumped)
    return name(fault.kind) +
           (": from " + wanted + " to " + measured + ", faster than any motor: check the encoder");
  const std::string values = ": commanded " + wanted + ", measured " + measured;
  if (fault.code != 0)
    return name(fault.kind) + values + formatted(", says the drive (statusword %04X)", fault.code);
  return name(fault.kind) + values + ", limit " + displacement_text(axis, following_error_limit(axis)) +
         " (drive.following_error): is it jammed, overloaded or without a motor?";
}

FollowingMonitor::FollowingMonitor(const AxisConfig& axis, int64_t feedback_period_ns) noexcept
    : limit_(following_error_limit(axis)),
      fastest_(axis.top_rate > 0 ? kFastest * axis.top_rate : kInfinity),
      slack_(slack(axis)),
      period_ns_(feedback_period_ns) {}

void FollowingMonitor::begin(double displacement, int64_t now_ns) noexcept {
  commanded_ = before_ = displacement;
  before_ns_ = now_ns;
}

DriveFault FollowingMonitor::judge(double displacement, int64_t arrival_ns) noexcept {
  const double seconds = 1e-9 * static_cast<double>(arrival_ns - before_ns_ + kJitter * period_ns_);
  const double before = before_;
  before_ = displacement;
  before_ns_ = arrival_ns;
  if (std::abs(displacement - before) > fastest_ * seconds + slack_)
    return {.kind = FaultKind::kFeedbackJumped, .wanted = before, .measured = displacement};
  return std::abs(displacement - commanded_) > limit_ ? not_following(displacement, 0) : DriveFault{};
}

DriveFault FollowingMonitor::not_following(double displacement, uint32_t code) const noexcept {
  return {.kind = FaultKind::kNotFollowing, .code = code, .wanted = commanded_, .measured = displacement};
}

}  // namespace tendril::hal
