#include "app/check_report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/bus_check.h"
#include "app/inverse_statics.h"
#include "app/model_refresher.h"
#include "app/motion.h"
#include "fem/mesh_quality.h"
#include "rt/periodic_clock.h"

namespace tendril::app {
namespace {

// A waypoint that the model misses by more than this is out of reach (the energy term alone costs about 0.1
// mm).
constexpr double kReached = 1e-3;  // m
constexpr int kTimedRefreshes = 20;

/// Effector coordinates for people: "(1.0, 2.0) mm, 3.25 ml", one item an effector.
std::string describe(const Config& config, const Eigen::VectorXd& p) {
  std::string text;
  const auto rows = effector_rows(config);
  for (size_t r = 0; r < rows.size(); ++r) {
    const bool first = r == 0 || rows[r].effector != rows[r - 1].effector;
    const bool last = r + 1 == rows.size() || rows[r].effector != rows[r + 1].effector;
    const double value = p[static_cast<Eigen::Index>(r)];
    if (r > 0) text += ", ";
    if (rows[r].is_position())
      text += fmt::format("{}{:.1f}{}", first ? "(" : "", 1e3 * value, last ? ") mm" : "");
    else
      text += fmt::format("{:.2f} ml", 1e6 * value);
  }
  return text;
}

/// The largest efforts of a solution, by unit: "2.10 N, 12.3 kPa".
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

/// How far the effector that moves is from its goal, m.
double miss_of(const Config& config, const Eigen::VectorXd& p_e, const rt::EffectorVector& goal) {
  double sum = 0;
  const auto rows = effector_rows(config);
  for (size_t r = 0; r < rows.size(); ++r)
    if (rows[r].effector == config.motion->effector)
      sum += std::pow(p_e[static_cast<Eigen::Index>(r)] - goal[static_cast<Eigen::Index>(r)], 2);
  return std::sqrt(sum);
}

/// Median time of a refresh at rest, s.
double time_refresh(ModelRefresher& model, rt::Snapshot& snapshot) {
  std::vector<double> times;
  rt::Feedback feedback;
  for (int k = 0; k < kTimedRefreshes; ++k) {
    const std::int64_t begin_ns = rt::now_ns();
    if (!model.refresh(feedback, begin_ns, snapshot)) break;
    times.push_back(1e-9 * static_cast<double>(rt::now_ns() - begin_ns));
  }
  if (times.empty()) return 0;
  std::nth_element(times.begin(), times.begin() + static_cast<long>(times.size() / 2), times.end());
  return times[times.size() / 2];
}

}  // namespace

int check_robot(const Config& config, bool json) {
  const hal::BusBudget budget = check_bus(config);
  const auto robot = build_model(config);
  const rt::ControllerConfig limits = controller_config(config);
  ModelRefresher model(*robot, config);
  const auto snapshot = std::make_unique<rt::Snapshot>();
  const bool rests = model.settle(Eigen::VectorXd::Zero(limits.actuators));
  const rt::EffectorVector at_rest = robot->constraints.effector_position(model.x());
  const double refresh_s = rests ? time_refresh(model, *snapshot) : 0;
  bool good = rests;

  nlohmann::ordered_json result;
  result["robot"] = config.robot;
  result["nodes"] = robot->model.mesh().node_count();
  result["tetrahedra"] = robot->model.mesh().tet_count();
  result["fixed_nodes"] = robot->model.mesh().node_count() - robot->model.free_nodes();
  const fem::Quality quality = fem::mesh_quality(robot->model.mesh());
  result["mean_ratio_min"] = quality.mean_ratio_min;
  result["mean_ratio_median"] = quality.mean_ratio_median;
  result["actuators"] = limits.actuators;
  result["effector_dofs"] = limits.effector_coordinates;
  result["bus_load"] = budget.load;
  result["rests"] = rests;
  result["effectors_at_rest"] = std::vector<double>(at_rest.begin(), at_rest.end());  // m or m³
  result["refresh_ms"] = 1e3 * refresh_s;
  result["waypoints"] = nlohmann::ordered_json::array();
  const std::string rest_line =
      rests ? fmt::format("rests with its effectors at {}, all actuators at displacement 0",
                          describe(config, at_rest))
            : "finds no rest with all actuators at displacement 0: is the body too soft for its weight?";
  std::string lines;
  if (config.motion && rests) {
    for (size_t k = 0; k < config.motion->waypoints.size(); ++k) {
      const rt::EffectorVector goal = goal_at(config, config.motion->waypoints[k], at_rest);
      const StaticReach reached = reach(*robot, config, goal);
      const double miss = reached.converged ? miss_of(config, reached.p_e, goal) : INFINITY;
      good = good && miss <= kReached;
      result["waypoints"].push_back({{"miss_mm", 1e3 * miss}, {"reached", miss <= kReached}});
      lines +=
          fmt::format("  waypoint {}   {} {}: the model comes to within {:.2f} mm, with efforts up to {}\n",
                      k, describe(config, goal), miss <= kReached ? "reached" : "OUT OF REACH", 1e3 * miss,
                      reached.converged ? largest_efforts(config, reached.lambda) : "what is not known");
    }
  }
  if (json) {
    fmt::print("{}\n", result.dump());
    return good ? 0 : 1;
  }
  fmt::print("{}: {}\n", config.file.string(), config.robot);
  fmt::print("  mesh         {} nodes, {} tetrahedra, {} nodes fixed\n", result["nodes"].get<int>(),
             result["tetrahedra"].get<int>(), result["fixed_nodes"].get<int>());
  fmt::print("  shape        {}\n", fem::summary(quality));
  fmt::print("  robot        {} actuators of at most {}, {} effector coordinates of at most {}\n",
             limits.actuators, kMaxActuators, limits.effector_coordinates, kMaxEffectorCoordinates);
  fmt::print("  bus          {}\n", budget.text);
  fmt::print("  body         {}\n", rest_line);
  fmt::print("  model        one refresh takes {:.1f} ms here: {:.0f} Hz\n{}", 1e3 * refresh_s,
             refresh_s > 0 ? 1 / refresh_s : 0, lines);
  fmt::print("{}\n", good ? "all is well" : "not all is well");
  return good ? 0 : 1;
}

}  // namespace tendril::app
