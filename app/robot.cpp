#include "app/robot.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "app/body.h"

namespace tendril::app {
namespace {

/// What attaches the parts of one actuator or effector to a body.
struct Attacher {
  const fem::Model& model;
  const Config& config;
  std::string key;  // for messages

  fem::Attachment at(const PointConfig& point) const { return attach(model, config, point, key); }
  fem::CablePoint end(const PointConfig& point) const {
    return point.on_body ? fem::CablePoint(at(point)) : fem::CablePoint(point.at);
  }
  std::vector<fem::Face> cavity(const RegionConfig& region) const {
    return wall(model, config, region, key + ".cavity");
  }

  fem::Actuator operator()(const CableConfig& cable) const {
    fem::Cable attached;
    for (const PointConfig& point : cable.points) attached.points.push_back(end(point));
    return attached;
  }
  fem::Actuator operator()(const RodConfig& rod) const { return fem::Rod{end(rod.from), end(rod.to)}; }
  fem::Actuator operator()(const ForceConfig& force) const {
    return fem::Force{at(force.at), force.direction};
  }
  fem::Actuator operator()(const CavityConfig& filled) const { return fem::Pressure{cavity(filled.region)}; }

  fem::Effector operator()(const EffectorConfig& effector) const {
    if (effector.cavity) return fem::VolumeEffector{cavity(*effector.cavity)};
    fem::PointEffector attached{{}, effector.controlled};
    for (const PointConfig& point : effector.points) attached.points.push_back(at(point));
    return attached;
  }
};

std::unique_ptr<Robot> build(const Config& config, fem::Model body) {
  std::vector<fem::Actuator> actuators;
  for (const ActuatorConfig& actuator : config.actuators)
    actuators.push_back(
        std::visit(Attacher{body, config, fmt::format("actuator '{}'", actuator.name)}, actuator.kind));
  std::vector<fem::Effector> effectors;
  for (const EffectorConfig& effector : config.effectors)
    effectors.push_back(Attacher{body, config, fmt::format("effector '{}'", effector.name)}(effector));
  try {
    return std::make_unique<Robot>(std::move(body), actuators, effectors);
  } catch (const std::invalid_argument& error) {
    throw ConfigError(fmt::format("{}: {}", config.file.string(), error.what()));
  }
}

std::int64_t nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

}  // namespace

Robot::Robot(fem::Model body, const std::vector<fem::Actuator>& actuators,
             const std::vector<fem::Effector>& effectors)
    : model(std::move(body)),
      tip_points(std::get<fem::PointEffector>(effectors.at(0)).points),
      constraints(model, actuators, effectors) {}

Eigen::Vector3d Robot::tip(const Eigen::VectorXd& x) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const fem::Attachment& point : tip_points) sum += model.position(x, point);
  return sum / static_cast<double>(tip_points.size());
}

std::unique_ptr<Robot> build_model(const Config& config) {
  return build(config, build_body(config, model_substance(config), config.loads));
}

std::unique_ptr<Robot> build_plant(const Config& config) {
  if (!config.plant)
    throw ConfigError(
        fmt::format("{}: plant: the section is missing; it says what the simulated robot is made of",
                    config.file.string()));
  std::vector<LoadConfig> loads = config.loads;
  loads.insert(loads.end(), config.plant->loads.begin(), config.plant->loads.end());
  return build(config, build_body(config, plant_substance(config), loads));
}

std::vector<EffectorRow> effector_rows(const Config& config) {
  std::vector<EffectorRow> rows;
  for (int k = 0; k < static_cast<int>(config.effectors.size()); ++k) {
    const EffectorConfig& effector = config.effectors[k];
    auto weight = effector.weights.begin();
    if (effector.cavity) rows.push_back({k, EffectorRow::kVolume, *weight});
    for (int axis = 0; axis < 3; ++axis)
      if (!effector.cavity && effector.controlled[axis]) rows.push_back({k, axis, *weight++});
  }
  return rows;
}

rt::ControllerConfig controller_config(const Config& config) {
  const auto m = static_cast<Eigen::Index>(config.actuators.size());
  const auto rows = effector_rows(config);
  rt::ControllerConfig result;
  result.actuators = static_cast<int>(m);
  result.effector_coordinates = static_cast<int>(rows.size());
  for (auto* v : {&result.a_min, &result.a_max, &result.l_min, &result.l_max, &result.v_max}) v->resize(m);
  for (Eigen::Index a = 0; a < m; ++a) {
    const ActuatorConfig& actuator = config.actuators[a];
    result.a_min[a] = actuator.effort_min;
    result.a_max[a] = actuator.effort_max;
    result.l_min[a] = actuator.displacement_min;
    result.l_max[a] = actuator.displacement_max;
    result.v_max[a] = actuator.top_rate;
  }
  const auto e = static_cast<Eigen::Index>(rows.size());
  result.workspace_min.setZero(e);  // of volumes
  result.workspace_max.setConstant(e, std::numeric_limits<double>::infinity());
  for (Eigen::Index r = 0; r < e; ++r) {
    if (!rows[r].is_position()) continue;
    result.workspace_min[r] = config.control.workspace_min[rows[r].axis];
    result.workspace_max[r] = config.control.workspace_max[rows[r].axis];
  }
  result.iteration_cap = config.control.iteration_cap;
  result.period_s = 1 / config.control.rate_hz;
  result.snapshot_age_limit_ns = nanoseconds(config.control.snapshot_age_limit);
  result.target_age_limit_ns = nanoseconds(config.control.target_age_limit);
  result.late_cycles_limit = config.control.late_cycles_limit;
  result.stop = config.control.stop;
  return result;
}

hal::MasterConfig master_config(const Config& config) {
  hal::MasterConfig result;
  for (const ActuatorConfig& actuator : config.actuators) {
    const DriveConfig& drive = actuator.drive;
    hal::AxisConfig axis;
    axis.name = actuator.name;
    axis.node = drive.node;
    axis.scale = {drive.counts_per_turn, drive.displacement_per_turn, drive.reversed};
    result.axes.push_back(axis);
  }
  result.period_ns = nanoseconds(1 / config.control.rate_hz);
  result.master_node = config.bus.master_node;
  result.heartbeat_ns = nanoseconds(config.bus.heartbeat);
  result.heartbeat_timeout_ns = nanoseconds(config.bus.heartbeat_timeout);
  result.tracker_id = static_cast<std::uint32_t>(config.bus.tracker_id);
  if (config.plant) result.tracker_rate_hz = config.plant->tracker_rate_hz;
  return result;
}

}  // namespace tendril::app
