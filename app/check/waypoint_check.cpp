// SPDX-License-Identifier: Apache-2.0
#include "app/check/waypoint_check.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/robot/motion.h"

namespace tendril::app {
namespace {

// An effort or displacement is at a limit where it is no further from it than this share of its range.
constexpr double kAtLimit = 1e-3;

const char* effort_key(const ActuatorConfig& actuator) {
  if (actuator.is_cavity()) return "pressure";
  return std::holds_alternative<CableConfig>(actuator.kind) ? "tension" : "force";
}

/// The largest efforts of a solution, by unit: "2.10 N, 12.30 kPa".
std::string largest_efforts(const Config& config, const Eigen::VectorXd& lambda) {
  std::string text;
  for (const bool pressure : {false, true}) {
    std::optional<double> largest;
    for (size_t a = 0; a < config.actuators.size(); ++a)
      if (config.actuators[a].is_cavity() == pressure)
        largest = std::max(largest.value_or(0), std::abs(lambda[static_cast<Eigen::Index>(a)]));
    if (!largest) continue;
    text += text.empty() ? "" : ", ";
    text += pressure ? fmt::format("{:.2f} kPa", 1e-3 * *largest) : fmt::format("{:.2f} N", *largest);
  }
  return text;
}

/// Why there is no answer.
std::string failure(const Config& config, const StaticSolution& statics) {
  switch (statics.obstacle) {
    case StaticSolution::Obstacle::kNoEquilibrium:
      return "no equilibrium was found";
    case StaticSolution::Obstacle::kQpCapped:
      return fmt::format("the QP was stopped at its cap of {} iterations, see control.iteration_cap",
                         controller_config(config).iteration_cap);
    case StaticSolution::Obstacle::kQpIllPosed:
      return "the QP was refused as ill-posed";
    case StaticSolution::Obstacle::kNoRest:
      break;
  }
  return fmt::format("efforts and body did not come to rest in {} refreshes of the model", statics.refreshes);
}

/// What keeps the model from a waypoint that it misses.
std::string obstacle(const Config& config, const WaypointCheck& waypoint) {
  if (waypoint.at_limits.empty() && waypoint.others_weigh)
    return "no actuator is at a limit: other effectors outweigh this one";
  if (waypoint.at_limits.empty())
    return fmt::format("no actuator is at a limit: the actuators do not move it that way{}",
                       config.control.epsilon > 0 ? ", or control.epsilon is large" : "");
  // Which of the two it is that holds it back, the solution does not say: a cable is slack often enough.
  return fmt::format("{}{}", describe(waypoint.at_limits),
                     waypoint.others_weigh ? "; other effectors may outweigh this one as well" : "");
}

}  // namespace

std::vector<AtLimit> limits_met(const Config& config, const Eigen::VectorXd& lambda,
                                const Eigen::VectorXd& delta_a) {
  std::vector<AtLimit> result;
  for (size_t a = 0; a < config.actuators.size(); ++a) {
    const ActuatorConfig& actuator = config.actuators[a];
    const auto compare = [&](double value, double min, double max, const char* quantity, double scale,
                             const char* unit) {
      const double near = kAtLimit * (max - min);
      if (value >= max - near) result.push_back({actuator.name, quantity, true, scale * max, unit});
      if (value <= min + near) result.push_back({actuator.name, quantity, false, scale * min, unit});
    };
    const auto k = static_cast<Eigen::Index>(a);
    const bool cavity = actuator.is_cavity();
    compare(lambda[k], actuator.effort_min, actuator.effort_max, effort_key(actuator), cavity ? 1e-3 : 1,
            cavity ? "kPa" : "N");
    compare(delta_a[k], actuator.displacement_min, actuator.displacement_max, cavity ? "growth" : "stroke",
            cavity ? 1e6 : 1e3, cavity ? "ml" : "mm");
  }
  return result;
}

std::string describe(const std::vector<AtLimit>& limits) {
  std::vector<std::string> parts;
  for (const AtLimit& at : limits)
    parts.push_back(fmt::format("{} ({} {} {:g} {})", at.actuator, at.greatest ? "greatest" : "least",
                                at.quantity, at.limit, at.unit));
  return fmt::format("at their limits: {}", fmt::join(parts, ", "));
}

nlohmann::ordered_json json_of(const std::vector<AtLimit>& limits) {
  auto list = nlohmann::ordered_json::array();
  for (const AtLimit& at : limits)
    list.push_back({{"actuator", at.actuator},
                    {"quantity", at.quantity},
                    {"side", at.greatest ? "greatest" : "least"},
                    {"limit", at.limit},
                    {"unit", at.unit}});
  return list;
}

WaypointCheck check_waypoint(const Robot& robot, const Config& config, const Eigen::Vector3d& waypoint,
                             const rt::EffectorVector& at_rest) {
  WaypointCheck result;
  result.goal = goal_at(config, waypoint, at_rest);
  result.statics = solve_inverse_statics(robot, config, result.goal);
  double sum = 0;
  const auto rows = effector_rows(config);
  for (size_t r = 0; r < rows.size(); ++r) {
    const auto k = static_cast<Eigen::Index>(r);
    if (rows[r].effector != config.motion->effector)
      result.others_weigh = result.others_weigh || rows[r].weight > 0;
    else if (result.statics.converged && rows[r].weight > 0)
      sum += std::pow(result.statics.p_e[k] - result.goal[k], 2);
  }
  if (!result.statics.converged) return result;
  result.miss = std::sqrt(sum);
  result.at_limits = limits_met(config, result.statics.lambda, result.statics.delta_a);
  return result;
}

std::string verdict(const Config& config, const WaypointCheck& waypoint) {
  if (!waypoint.miss) return "NOT REACHED: " + failure(config, waypoint.statics);
  const std::string within = fmt::format("the model comes to within {:.2f} mm", 1e3 * *waypoint.miss);
  const std::string efforts =
      fmt::format("with efforts up to {}", largest_efforts(config, waypoint.statics.lambda));
  if (waypoint.reached())
    return fmt::format("reached: {} ({:g} mm counts as reached), {}", within, 1e3 * kReached, efforts);
  return fmt::format("OUT OF REACH: {}, more than {:g} mm, {}; {}", within, 1e3 * kReached, efforts,
                     obstacle(config, waypoint));
}

}  // namespace tendril::app
