// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hal/drive/master_config.h"

namespace tendril::hal {

/// Monitors whether an axis that follows efforts stays within the range of its displacements. With a broken
/// or slack cable nothing else stops its winch. An axis that is outside when it is enabled may stay there,
/// plus the margin.
/// Real-time: every function (bounded, no allocation).
class RangeMonitor {
 public:
  /// @param axis  with finite limits where it follows efforts; any other axis is never out of range
  explicit RangeMonitor(const AxisConfig& axis) noexcept
      : monitors_(axis.set_point == SetPoint::kEffort),
        least_(axis.displacement_min),
        greatest_(axis.displacement_max),
        margin_(std::max(kMargin * (greatest_ - least_), kLeastMargin * axis.scale.displacement_per_turn)) {
    begin(least_);
  }

  /// How far beyond its limits the axis may be, m or m³.
  double margin() const noexcept { return margin_; }

  /// Begins to monitor. @param displacement  at which the axis is about to be enabled, m or m³
  void begin(double displacement) noexcept {
    lower_ = std::min(least_, displacement) - margin_;
    upper_ = std::max(greatest_, displacement) + margin_;
  }

  /// Whether the axis has left its range. @param displacement  m or m³
  bool is_outside(double displacement) const noexcept {
    return monitors_ && !(displacement >= lower_ && displacement <= upper_);
  }

  /// How far the axis is beyond the nearer limit, in thousandths of the range, negative below the least
  /// displacement. @param displacement  m or m³
  int32_t excess(double displacement) const noexcept {
    const double outside = displacement - std::clamp(displacement, least_, greatest_);
    const double range = std::max(greatest_ - least_, margin_);
    return static_cast<int32_t>(std::clamp(std::round(1e3 * outside / range), -2e9, 2e9));
  }

 private:
  static constexpr double kMargin = 0.02;        // of the range
  static constexpr double kLeastMargin = 0.001;  // of a turn: few encoders have a coarser resolution

  bool monitors_;
  double least_, greatest_, margin_;  // m or m³
  double lower_ = 0, upper_ = 0;      // where it may be, m or m³
};

}  // namespace tendril::hal
