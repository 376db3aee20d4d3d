// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "app/config/config.h"

namespace tendril::app {

/// Closed paths that need no waypoints of their own.
enum class Shape { kLine, kSquare, kCircle, kEight, kLissajous };

/// How a shape is laid out in space.
struct Layout {
  std::array<double, 2> size{};     // m, of the whole shape along the two axes of its plane
  std::pair<int, int> plane{0, 1};  // 0 x, 1 y, 2 z
  std::array<double, 2> frequencies{3, 2};
};

inline constexpr std::array<std::pair<std::string_view, Shape>, 5> kShapes{
    {{"circle", Shape::kCircle},
     {"square", Shape::kSquare},
     {"line", Shape::kLine},
     {"eight", Shape::kEight},
     {"lissajous", Shape::kLissajous}}};
inline constexpr std::array<std::pair<std::string_view, std::pair<int, int>>, 6> kPlanes{
    {{"xy", {0, 1}}, {"yx", {1, 0}}, {"xz", {0, 2}}, {"zx", {2, 0}}, {"yz", {1, 2}}, {"zy", {2, 1}}}};

/// The curve that a shape is; none where it has straight sides. Real-time: no.
std::optional<CurveConfig> curve_of(Shape shape, const Layout& layout);

/// The point of a curve at an angle, m from its centre. Real-time: yes.
Eigen::Vector3d point_of(const CurveConfig& curve, double angle);

/// The corners of a shape with straight sides, or kWaypointsOfCurve points of a curve, m from its centre.
/// Real-time: no.
std::vector<Eigen::Vector3d> waypoints_of(Shape shape, const Layout& layout);

}  // namespace tendril::app
