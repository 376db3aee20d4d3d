// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "hal/drive/drives.h"
#include "hal/drive/master_config.h"

namespace tendril::hal {

/// How far an enabled axis may be from its command, m or m³: what the robot file says, else what a sound
/// drive lags behind at the top rate (0.03 s), and a hundredth of the range. Infinite where neither is known,
/// and for an axis that follows efforts. Real-time: yes.
double following_error_limit(const AxisConfig& axis) noexcept;

/// A fault of kind kNotFollowing or kFeedbackJumped in words, without the name of the axis. Real-time: no
/// (allocates).
std::string describe_motion_fault(const AxisConfig& axis, const DriveFault& fault);

/// Monitors whether an enabled axis goes where it is commanded, by the positions that it sends.
/// Real-time: every function (bounded, no allocation).
class FollowingMonitor {
 public:
  /// @param feedback_period_ns  between two positions of the drive
  FollowingMonitor(const AxisConfig& axis, int64_t feedback_period_ns) noexcept;

  /// Begins to monitor. @param displacement  at which the axis is enabled, m or m³
  void begin(double displacement, int64_t now_ns) noexcept;

  /// Takes what is commanded. @param displacement  m or m³
  void command(double displacement) noexcept { commanded_ = displacement; }

  /// Judges a position.
  /// @param displacement  m or m³
  /// @return  kFeedbackJumped, kNotFollowing or kNone
  DriveFault judge(double displacement, int64_t arrival_ns) noexcept;

  /// The fault of an axis whose drive says that it does not follow. @param code  for DriveFault::code
  DriveFault not_following(double displacement, uint32_t code) const noexcept;

 private:
  double limit_;           // m or m³
  double fastest_;         // no motor of this axis is faster, m/s or m³/s
  double slack_;           // what a position may err by, m or m³
  int64_t period_ns_;      // of the positions
  double commanded_ = 0;   // m or m³
  double before_ = 0;      // last position, m or m³
  int64_t before_ns_ = 0;  // when it arrived
};

}  // namespace tendril::hal
