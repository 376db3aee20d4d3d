#include "app/check_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/bus_check.h"
#include "app/inverse_statics.h"
#include "app/model_refresher.h"
#include "app/motion.h"
#include "rt/periodic_clock.h"

namespace tendril::app {
namespace {

// A waypoint that the model misses by more than this is out of reach (the energy term alone costs about 0.1
// mm).
constexpr double kReached = 1e-3;  // m
constexpr int kTimedRefreshes = 20;

std::string millimetres(const Eigen::VectorXd& p) {
  std::string text;
  for (Eigen::Index k = 0; k < p.size(); ++k) text += fmt::format("{}{:.1f}", k ? ", " : "", 1e3 * p[k]);
  return "(" + text + ") mm";
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
  ModelRefresher model(*robot, config.control.epsilon);
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
  result["actuators"] = limits.actuators;
  result["effector_dofs"] = limits.effector_coordinates;
  result["bus_load"] = budget.load;
  result["rests"] = rests;
  result["effector_at_rest_m"] = std::vector<double>(at_rest.begin(), at_rest.end());
  result["refresh_ms"] = 1e3 * refresh_s;
  result["waypoints"] = nlohmann::ordered_json::array();
  const std::string rest_line =
      rests ? fmt::format("comes to rest with the effectors at {}, all cables at rest length",
                          millimetres(at_rest))
            : "finds no rest with all cables at rest length: is the body too soft for its weight?";
  std::string lines;
  if (config.motion && rests) {
    for (size_t k = 0; k < config.motion->waypoints.size(); ++k) {
      const rt::EffectorVector goal = goal_at(config, config.motion->waypoints[k], at_rest);
      const StaticReach reached = reach(*robot, limits, config.control.epsilon, goal);
      const double miss = reached.converged ? (reached.p_e - goal).norm() : INFINITY;
      good = good && miss <= kReached;
      result["waypoints"].push_back({{"miss_mm", 1e3 * miss}, {"reached", miss <= kReached}});
      lines +=
          fmt::format("  waypoint {}   {} {}: the model comes to within {:.2f} mm, strongest pull {:.2f} N\n",
                      k, millimetres(goal), miss <= kReached ? "reached" : "OUT OF REACH", 1e3 * miss,
                      reached.converged ? reached.lambda.maxCoeff() : NAN);
    }
  }
  if (json) {
    fmt::print("{}\n", result.dump());
    return good ? 0 : 1;
  }
  fmt::print("{}: {}\n", config.file.string(), config.robot);
  fmt::print("  mesh         {} nodes, {} tetrahedra, {} nodes fixed\n", result["nodes"].get<int>(),
             result["tetrahedra"].get<int>(), result["fixed_nodes"].get<int>());
  fmt::print("  robot        {} actuators, {} effector coordinates\n", limits.actuators,
             limits.effector_coordinates);
  fmt::print("  bus          {}\n", budget.text);
  fmt::print("  body         {}\n", rest_line);
  fmt::print("  model        one refresh takes {:.1f} ms here: {:.0f} Hz\n{}", 1e3 * refresh_s,
             refresh_s > 0 ? 1 / refresh_s : 0, lines);
  fmt::print("{}\n", good ? "all is well" : "not all is well");
  return good ? 0 : 1;
}

}  // namespace tendril::app
