// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/robot/inverse_statics.h"
#include "app/robot/robot.h"

namespace tendril::app {

/// A waypoint that the model misses by no more than this counts as reached: the energy term alone costs about
/// 0.1 mm.
inline constexpr double kReached = 1e-3;  // m

/// A limit that an actuator stands at.
struct AtLimit {
  std::string actuator;  ///< its name
  const char* quantity;  ///< the key of its limits: "tension", "stroke"…
  bool greatest;         ///< of the two limits the upper one
  double limit;          ///< N, kPa, mm or ml
  const char* unit;
};

/// The limits of effort and displacement that actuators stand at.
/// @param lambda   efforts, m, N or Pa
/// @param delta_a  displacements, m, m or m³
/// Real-time: no.
std::vector<AtLimit> limits_met(const Config& config, const Eigen::VectorXd& lambda,
                                const Eigen::VectorXd& delta_a);

/// "at their limits: right (greatest tension 2 N), left (least stroke -3 mm)".
std::string describe(const std::vector<AtLimit>& limits);

/// The same for machines, one entry a limit.
nlohmann::ordered_json json_of(const std::vector<AtLimit>& limits);

/// How near the model comes to one waypoint, and what keeps it from coming nearer.
struct WaypointCheck {
  rt::EffectorVector goal;  ///< e, m or m³
  StaticSolution statics;   ///< without a result where no equilibrium was found
  /// Of the effector that moves, in its coordinates with a weight above 0, m; none where no equilibrium was
  /// found.
  std::optional<double> miss;
  std::vector<AtLimit> at_limits;  ///< none where no equilibrium was found
  bool others_weigh = false;       ///< whether other effectors have a say

  bool reached() const { return miss && *miss <= kReached; }
};

/// @param at_rest  the effectors' coordinates with all actuators at displacement 0, e, m or m³
/// Real-time: no.
WaypointCheck check_waypoint(const Robot& robot, const Config& config, const Eigen::Vector3d& waypoint,
                             const rt::EffectorVector& at_rest);

/// What a person should know of it: "reached: the model comes to within 0.15 mm (1 mm counts as reached),
/// with efforts up to 1.76 N".
std::string verdict(const Config& config, const WaypointCheck& waypoint);

}  // namespace tendril::app
