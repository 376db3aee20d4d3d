#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hal/drive/master_config.h"

namespace tendril::hal {

/// Whether an axis that follows efforts keeps to the range of its displacements: where a cable breaks or
/// hangs loose, nothing else ends the run of its winch. An axis that is found outside may be there, and a
/// margin farther.
/// Real-time: every function (bounded, no allocation).
class RangeWatch {
 public:
  /// @param axis  with finite limits where it follows efforts; any other is never out of range
  explicit RangeWatch(const AxisConfig& axis) noexcept
      : watches_(axis.set_point == SetPoint::kEffort),
        least_(axis.displacement_min),
        greatest_(axis.displacement_max),
        margin_(std::max(kMargin * (greatest_ - least_), kLeastMargin * axis.scale.displacement_per_turn)) {
    begin(least_);
  }

  /// How far beyond its limits the axis may be found, m or m³.
  double margin() const noexcept { return margin_; }

  /// Takes the displacement at which the axis is about to be enabled, m or m³.
  void begin(double displacement) noexcept {
    lower_ = std::min(least_, displacement) - margin_;
    upper_ = std::max(greatest_, displacement) + margin_;
  }

  /// Whether it has left its range.
  bool left_at(double displacement) const noexcept {
    return watches_ && !(displacement >= lower_ && displacement <= upper_);
  }

  /// How far it is beyond the nearer limit, in thousandths of the range, negative below the least
  /// displacement.
  int32_t beyond(double displacement) const noexcept {
    const double outside = displacement - std::clamp(displacement, least_, greatest_);
    const double range = std::max(greatest_ - least_, margin_);
    return static_cast<int32_t>(std::clamp(std::round(1e3 * outside / range), -2e9, 2e9));
  }

 private:
  static constexpr double kMargin = 0.02;        // of the range
  static constexpr double kLeastMargin = 0.001;  // of a turn: few encoders are coarser

  bool watches_;
  double least_, greatest_, margin_;
  double lower_ = 0, upper_ = 0;  // where it may be
};

}  // namespace tendril::hal
