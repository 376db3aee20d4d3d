// SPDX-License-Identifier: Apache-2.0
#include "app/check/check_report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/check/cycle_budget.h"
#include "app/check/path_check.h"
#include "app/check/progress.h"
#include "app/check/waypoint_check.h"
#include "app/config/utf8.h"
#include "app/robot/body.h"
#include "app/robot/bus_check.h"
#include "app/robot/cpu_time.h"
#include "app/robot/model_refresher.h"
#include "app/robot/qp_budget.h"
#include "app/robot/robot.h"
#include "fem/mesh/mesh_quality.h"
#include "hal/drive/drive_protocol.h"
#include "rt/periodic_clock.h"

namespace tendril::app {
namespace {

constexpr int kTimedRefreshes = 20;
// Between them and 0.5 linear tetrahedra are far too stiff, docs/validation.md.
constexpr double kLocksAbove = 0.46;
// What soft bodies weigh, from foam to metal powder in silicone; anything else is a wrong unit.  kg/m³
constexpr double kDensityMin = 100, kDensityMax = 20000;

/// A number of decimals, but never "-0.0".
std::string decimals(double value, int digits) {
  const double scale = std::pow(10, digits);
  return fmt::format("{:.{}f}", std::round(value * scale) / scale + 0.0, digits);
}

std::string count(int n, const char* noun) { return fmt::format("{} {}{}", n, noun, n == 1 ? "" : "s"); }

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
      text += fmt::format("{}{}{}", first ? "(" : "", decimals(1e3 * value, 1), last ? ") mm" : "");
    else
      text += decimals(1e6 * value, 2) + " ml";
  }
  return text;
}

/// Median time on the CPU of a refresh at rest, s.
double time_refresh(ModelRefresher& model, rt::Snapshot& snapshot) {
  std::vector<double> times;
  rt::Feedback feedback;
  for (int k = 0; k < kTimedRefreshes; ++k) {
    const double begin_s = cpu_seconds();
    if (!model.refresh(feedback, rt::now_ns(), snapshot)) break;
    times.push_back(cpu_seconds() - begin_s);
  }
  if (times.empty()) return 0;
  std::nth_element(times.begin(), times.begin() + static_cast<long>(times.size() / 2), times.end());
  return times[times.size() / 2];
}

/// What is said of the robot: as JSON, as lines for people, and what is worth a second look.
struct Report {
  nlohmann::ordered_json json;
  std::string lines;
  std::vector<std::string> advice;

  void line(const std::string& subject, const std::string& text) {
    lines += fmt::format("  {:12s} {}\n", subject, text);
  }
};

void report_mesh(const fem::Model& model, Report& report) {
  const fem::Mesh& mesh = model.mesh();
  const fem::Quality quality = fem::mesh_quality(mesh);
  const int fixed = mesh.node_count() - model.free_nodes();
  report.json["nodes"] = mesh.node_count();
  report.json["tetrahedra"] = mesh.tet_count();
  report.json["fixed_nodes"] = fixed;
  report.json["mean_ratio_min"] = quality.mean_ratio_min;
  report.json["mean_ratio_median"] = quality.mean_ratio_median;
  report.line("mesh", fmt::format("{} nodes, {} tetrahedra, {} nodes fixed", mesh.node_count(),
                                  mesh.tet_count(), fixed));
  report.line("shape", fem::summary(quality));
}

void report_size(const Config& config, const fem::Mesh& mesh, Report& report) {
  const Eigen::Vector3d size = 1e3 * (mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff());
  double volume = 0;
  for (const auto& [a, b, c, d] : mesh.tets)
    volume += fem::signed_volume(mesh.nodes.col(a), mesh.nodes.col(b), mesh.nodes.col(c), mesh.nodes.col(d));
  const double density = config.material.mass / volume;
  report.json["size_mm"] = std::vector<double>(size.begin(), size.end());
  report.json["volume_ml"] = 1e6 * volume;
  report.json["density_kg_per_m3"] = density;
  report.line("size", fmt::format("{:.4g} x {:.4g} x {:.4g} mm, {:.4g} ml, {:.4g} kg/m^3", size.x(), size.y(),
                                  size.z(), 1e6 * volume, density));
  if (density < kDensityMin || density > kDensityMax)
    report.advice.push_back(fmt::format(
        "material.mass and the mesh make {:.4g} kg/m^3, expected {:g} to {:g}: is mesh.unit right?", density,
        kDensityMin, kDensityMax));
}

void report_cavities(const Config& config, const fem::Model& model, Report& report) {
  report.json["cavities"] = nlohmann::ordered_json::array();
  std::string text;
  const auto add = [&](const std::string& name, const RegionConfig& region) {
    const double volume_ml =
        1e6 * fem::enclosed_volume(model.mesh(), wall(model.mesh(), config, region, name));
    report.json["cavities"].push_back({{"name", name}, {"volume_at_rest_ml", volume_ml}});
    text += fmt::format("{}{} {:.4g} ml", text.empty() ? "" : ", ", name, volume_ml);
  };
  for (const ActuatorConfig& actuator : config.actuators)
    if (const auto* filled = std::get_if<CavityConfig>(&actuator.kind)) add(actuator.name, filled->region);
  for (const EffectorConfig& effector : config.effectors)
    if (effector.cavity) add(effector.name, *effector.cavity);
  if (!text.empty()) report.line("cavities", text + " in the shape of the mesh");
}

/// Which actuators are commanded their efforts, and in what steps where their drives count torques.
void report_efforts(const Config& config, Report& report) {
  report.json["follow_efforts"] = nlohmann::ordered_json::array();
  std::string text;
  for (const ActuatorConfig& actuator : config.actuators) {
    if (!actuator.follows_effort()) continue;
    report.json["follow_efforts"].push_back(actuator.name);
    text += (text.empty() ? "" : ", ") + actuator.name;
    const double step = config.bus.master.protocol->effort_step(actuator.drive);
    if (step == 0) continue;
    text += fmt::format(" in steps of {:.3g} {}", actuator.is_cavity() ? 1e-3 * step : step,
                        actuator.is_cavity() ? "kPa" : "N");
  }
  if (!text.empty()) report.line("efforts", "commanded instead of displacements: " + text);
}

void report_sensors(const Config& config, Report& report) {
  report.json["sensors"] = nlohmann::ordered_json::array();
  std::string text;
  for (const SensorConfig& sensor : config.sensors) {
    std::string signals;
    for (const hal::Signal& signal : sensor.frame.signals)
      signals += (signals.empty() ? "" : ", ") + signal.name;
    report.json["sensors"].push_back({{"name", sensor.frame.name}, {"required", sensor.frame.required}});
    text += fmt::format("{}{} at {:g} Hz ({})", text.empty() ? "" : "; ", sensor.frame.name,
                        sensor.frame.rate_hz, signals);
  }
  if (!text.empty()) report.line("sensors", text);
}

void advise_on_locking(const Config& config, Report& report) {
  const auto advise = [&](const fem::Material& material, const std::string& key) {
    if (material.poisson_ratio > kLocksAbove && material.dilatation == fem::Dilatation::kElement)
      report.advice.push_back(fmt::format(
          "{}.poisson_ratio {:g} locks with dilatation: element, see docs/validation.md; use patches", key,
          material.poisson_ratio));
  };
  advise(config.material.material, "material");
  for (size_t k = 0; k < config.material.regions.size(); ++k)
    advise(config.material.regions[k].material, fmt::format("material.regions[{}]", k));
}

/// Targets outside the workspace are refused: a path that begins outside would be joined where it enters, at
/// top rates.
/// @return  whether the effectors are inside at rest
bool report_workspace(const Config& config, const rt::EffectorVector& at_rest,
                      const rt::ControllerConfig& limits, Report& report) {
  const bool fits = (at_rest.array() >= limits.workspace_min.array()).all() &&
                    (at_rest.array() <= limits.workspace_max.array()).all();
  report.json["rests_in_workspace"] = fits;
  if (!fits)
    report.line("workspace",
                fmt::format("control.workspace DOES NOT HOLD the effectors at rest, {}: make it larger",
                            describe(config, at_rest)));
  return fits;
}

/// @return  whether all of them are reached
bool report_waypoints(const Config& config, const Robot& robot, const rt::EffectorVector& at_rest,
                      Report& report) {
  bool good = true;
  report.json["reached_within_mm"] = 1e3 * kReached;
  for (size_t k = 0; k < config.motion->waypoints.size(); ++k) {
    const WaypointCheck waypoint = check_waypoint(robot, config, config.motion->waypoints[k], at_rest);
    nlohmann::ordered_json entry;
    entry["miss_mm"] = waypoint.miss ? nlohmann::ordered_json(1e3 * *waypoint.miss) : nullptr;
    entry["reached"] = waypoint.reached();
    entry["at_limits"] = json_of(waypoint.at_limits);
    report.json["waypoints"].push_back(entry);
    report.line(fmt::format("waypoint {}", k),
                fmt::format("{} {}", describe(config, waypoint.goal), verdict(config, waypoint)));
    good = good && waypoint.reached();
  }
  return good;
}

/// @return  whether the model keeps to the path
bool report_path(const Config& config, double refresh_s, Report& report) {
  Progress progress("simulating the path");
  const PathCheck path = check_path(config, refresh_s, [&](double share) { progress.show(share); });
  report.json["path"] = json_of(config, path);
  report.line("path", verdict(config, path));
  for (const std::string& advice : advice_on_path(config, path)) report.advice.push_back(advice);
  return path.follows();
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

  Report report;
  report.json["robot"] = config.robot;
  report_mesh(robot->model, report);
  report_size(config, robot->model.mesh(), report);
  report_cavities(config, robot->model, report);
  advise_on_locking(config, report);
  for (const auto& remarks : {advice_on_drives(config), warnings_on_drives(config)})
    report.advice.insert(report.advice.end(), remarks.begin(), remarks.end());
  report.json["actuators"] = limits.actuators;
  report.json["effector_dofs"] = limits.effector_coordinates;
  report.json["bus_load"] = budget.load;
  report.json["rests"] = rests;
  report.json["effectors_at_rest"] = std::vector<double>(at_rest.begin(), at_rest.end());  // m or m³
  report.json["refresh_ms"] = 1e3 * refresh_s;
  report.json["waypoints"] = nlohmann::ordered_json::array();
  report.line("robot", fmt::format("{} of at most {}, {} of at most {}", count(limits.actuators, "actuator"),
                                   kMaxActuators, count(limits.effector_coordinates, "effector coordinate"),
                                   kMaxEffectorCoordinates));
  report_efforts(config, report);
  report.line("bus", budget.text);
  report_sensors(config, report);
  report.line(
      "body",
      rests ? fmt::format("rests with its effectors at {}, all actuators at displacement 0",
                          describe(config, at_rest))
            : "finds no rest with all actuators at displacement 0: is the body too soft for its weight?");
  if (refresh_s > 0)
    report.line("model",
                fmt::format("one refresh takes {:.1f} ms here: {:.0f} Hz", 1e3 * refresh_s, 1 / refresh_s));
  const QpBudget qp = judge_qp(config, time_iteration(*robot, config));
  report.json["qp_iteration_us"] = 1e6 * qp.iteration_s;
  report.json["iteration_cap"] = qp.cap;
  report.line("QP", qp.text);
  const CycleCost cost = time_cycle(*robot, config);
  const CycleBudget cycle = judge_cycle(config, cost, qp);
  report.json["cycle_us"] = {{"read", 1e6 * cost.read_s},
                             {"decide", 1e6 * cost.solve_s},
                             {"qp_at_cap", 1e6 * qp.cap * qp.iteration_s},
                             {"write", 1e6 * cost.write_s},
                             {"whole", 1e6 * cycle.whole_s},
                             {"period", 1e6 / config.control.rate_hz}};
  report.json["cycle_margin"] = cycle.margin;
  report.line("cycle", cycle.text);
  const bool fits = !rests || report_workspace(config, at_rest, limits, report);
  bool good = rests;
  if (config.motion && rests) {
    const bool reached = report_waypoints(config, *robot, at_rest, report);
    const bool follows = report_path(config, refresh_s, report);
    good = reached && follows;
  }
  good = good && fits;
  report.json["advice"] = report.advice;
  for (const std::string& advice : report.advice) report.line("advice", advice);
  if (json) {
    fmt::print("{}\n", to_text(report.json));
  } else {
    fmt::print("{}: {}\n{}{}\n", config.file.string(), config.robot, report.lines,
               good ? "all is well" : "not all is well");
  }
  return good ? 0 : 1;
}

}  // namespace tendril::app
