// SPDX-License-Identifier: Apache-2.0
#include "app/client/shape_trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "app/config/config_error.h"

namespace tendril::app {
namespace {

constexpr int kPointsOfCurve = 720;  // between them a circle of 20 mm is missed by 0.1 um
constexpr int kPointsOfSide = 100;
constexpr double kRamp_s = 0.5;

/// One turn, its first point again at its end.
std::vector<Eigen::Vector3d> turn_of(const ShapeRequest& request) {
  std::vector<Eigen::Vector3d> points;
  if (const auto curve = curve_of(request.shape, request.layout)) {
    for (int k = 0; k < kPointsOfCurve; ++k)
      points.push_back(point_of(*curve, 2 * std::numbers::pi * k / kPointsOfCurve));
  } else {
    const auto corners = waypoints_of(request.shape, request.layout);
    for (std::size_t c = 0; c < corners.size(); ++c)
      for (int k = 0; k < kPointsOfSide; ++k)
        points.push_back(corners[c] + (corners[(c + 1) % corners.size()] - corners[c]) * k / kPointsOfSide);
  }
  points.push_back(points.front());
  return points;
}

/// When a way of so many metres is done, if the speed rises and falls evenly at its ends.  s
double time_at(double way, double whole, double speed) {
  const double ramp_s = std::min(kRamp_s, whole / speed), rising = speed * ramp_s / 2;
  if (way < rising) return std::sqrt(2 * way * ramp_s / speed);
  const double end_s = whole / speed + ramp_s;
  if (way > whole - rising) return end_s - std::sqrt(2 * std::max(0.0, whole - way) * ramp_s / speed);
  return way / speed + ramp_s / 2;
}

}  // namespace

std::array<std::string, 2> coordinates_of(const Layout& layout, const std::string& effector,
                                          const std::vector<std::string>& coordinates) {
  std::array<std::string, 2> names;
  const std::array axes{layout.plane.first, layout.plane.second};
  for (std::size_t k = 0; k < names.size(); ++k) {
    names[k] = fmt::format("{}.{}", effector, "xyz"[axes[k]]);
    if (std::ranges::find(coordinates, names[k]) == coordinates.end())
      throw ConfigError(fmt::format("the robot does not control {}: choose another --plane", names[k]));
  }
  return names;
}

Trajectory shape_trajectory(const ShapeRequest& request, const std::string& effector,
                            const std::vector<std::string>& coordinates) {
  const auto names = coordinates_of(request.layout, effector, coordinates);
  const std::vector<Eigen::Vector3d> turn = turn_of(request);
  std::vector<double> ways{0};
  for (std::size_t k = 1; k < turn.size(); ++k) ways.push_back(ways.back() + (turn[k] - turn[k - 1]).norm());
  const double whole = request.turns * ways.back();
  std::vector<double> times;
  std::vector<std::vector<double>> points;
  for (int n = 0; n < request.turns; ++n)
    for (std::size_t k = n == 0 ? 0 : 1; k < turn.size(); ++k) {
      times.push_back(time_at(n * ways.back() + ways[k], whole, request.speed));
      points.push_back({request.centre[0] + turn[k][request.layout.plane.first],
                        request.centre[1] + turn[k][request.layout.plane.second]});
    }
  return Trajectory({names[0], names[1]}, std::move(times), std::move(points));
}

}  // namespace tendril::app
