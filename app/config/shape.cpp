// SPDX-License-Identifier: Apache-2.0
#include "app/config/shape.h"

#include <numbers>

namespace tendril::app {

std::optional<CurveConfig> curve_of(Shape shape, const Layout& layout) {
  if (shape == Shape::kLine || shape == Shape::kSquare) return std::nullopt;
  constexpr double kQuarter = std::numbers::pi / 2;
  const auto [first, second] = layout.plane;
  CurveConfig curve;
  curve.amplitude[first] = layout.size[0] / 2;
  curve.amplitude[second] = layout.size[1] / 2;
  curve.frequency[first] = shape == Shape::kLissajous ? layout.frequencies[0] : 1;
  curve.frequency[second] = shape == Shape::kLissajous ? layout.frequencies[1]
                            : shape == Shape::kEight   ? 2
                                                       : 1;
  // A circle begins at its greatest first coordinate and turns from the first axis to the second.
  if (shape != Shape::kEight) curve.phase[first] = kQuarter;
  return curve;
}

Eigen::Vector3d point_of(const CurveConfig& curve, double angle) {
  return curve.amplitude.array() * (curve.frequency.array() * angle + curve.phase.array()).sin();
}

std::vector<Eigen::Vector3d> waypoints_of(Shape shape, const Layout& layout) {
  std::vector<Eigen::Vector3d> waypoints;
  const auto add = [&](double x, double y) {
    Eigen::Vector3d& point = waypoints.emplace_back(Eigen::Vector3d::Zero());
    point[layout.plane.first] = x * layout.size[0] / 2;
    point[layout.plane.second] = y * layout.size[1] / 2;
  };
  if (const auto curve = curve_of(shape, layout))
    for (int k = 0; k < kWaypointsOfCurve; ++k)
      waypoints.push_back(point_of(*curve, 2 * std::numbers::pi * k / kWaypointsOfCurve));
  else if (shape == Shape::kLine)
    for (const double side : {1, -1}) add(side, side);
  else
    for (const auto& [x, y] : {std::pair{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}) add(x, y);
  return waypoints;
}

}  // namespace tendril::app
