// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "app/client/trajectory.h"
#include "app/config/shape.h"

namespace tendril::app {

/// A shape as an operator wants to see it.
struct ShapeRequest {
  Shape shape = Shape::kCircle;
  Layout layout;
  std::array<double, 2> centre{};  // m, along the two axes of the plane
  double speed = 0.02;             // along it, m/s
  int turns = 1;
};

/// The shape as a table: at constant speed along it, from rest and to rest within half a second each.
/// @param effector     that shall follow it: "tip"
/// @param coordinates  that the robot has
/// @throws ConfigError where the effector lacks a coordinate of the plane
/// Real-time: no.
Trajectory shape_trajectory(const ShapeRequest& request, const std::string& effector,
                            const std::vector<std::string>& coordinates);

/// The names of the two coordinates of the plane: "tip.x", "tip.y".
/// @throws as shape_trajectory()
std::array<std::string, 2> coordinates_of(const Layout& layout, const std::string& effector,
                                          const std::vector<std::string>& coordinates);

}  // namespace tendril::app
