// SPDX-License-Identifier: Apache-2.0
#include "app/robot/robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/config/readings.h"
#include "app/robot/body.h"
#include "app/robot/place.h"

namespace tendril::app {
namespace {

/// What attaches the parts of one actuator or effector to a body.
struct Attacher {
  const fem::Mesh& mesh;
  const Config& config;
  std::string key;  // for messages

  fem::Attachment at(const PointConfig& point) const { return attach(mesh, config, point, key); }
  fem::CablePoint end(const PointConfig& point) const {
    return point.on_body ? fem::CablePoint(at(point)) : fem::CablePoint(point.at);
  }
  std::vector<fem::Face> cavity(const RegionConfig& region) const { return wall(mesh, config, region, key); }

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

/// Refuses to take more out of a cavity than is in it.
void check_growth(const fem::Model& body, const Config& config, int index, const fem::Pressure& pressure) {
  const ActuatorConfig& actuator = config.actuators[index];
  const double volume = fem::enclosed_volume(body.mesh(), pressure.surface);
  if (actuator.displacement_min > -volume) return;
  refuse(config, std::get<CavityConfig>(actuator.kind).growth_line,
         fmt::format("{}: found {:g} ml, expected more than {:.4g} ml, as the cavity holds {:.4g} ml at rest",
                     actuator_key(config, index, "growth"), 1e6 * actuator.displacement_min, -1e6 * volume,
                     1e6 * volume));
}

std::vector<fem::Actuator> attach_actuators(const fem::Model& body, const Config& config) {
  std::vector<fem::Actuator> result;
  for (int a = 0; a < static_cast<int>(config.actuators.size()); ++a) {
    const ActuatorConfig& actuator = config.actuators[a];
    const Attacher attacher{body.mesh(), config, actuator_key(config, a, place_of(actuator).key)};
    result.push_back(std::visit(attacher, actuator.kind));
    if (const auto* pressure = std::get_if<fem::Pressure>(&result.back()))
      check_growth(body, config, a, *pressure);
  }
  return result;
}

std::vector<fem::Effector> attach_effectors(const fem::Model& body, const Config& config) {
  std::vector<fem::Effector> result;
  for (int e = 0; e < static_cast<int>(config.effectors.size()); ++e) {
    const EffectorConfig& effector = config.effectors[e];
    result.push_back(
        Attacher{body.mesh(), config, effector_key(config, e, place_of(effector).key)}(effector));
  }
  return result;
}

[[noreturn]] void refuse(const Config& config, const fem::ConstraintError& error) {
  const bool is_actuator = error.role == fem::ConstraintError::kActuator;
  const Place place =
      is_actuator ? place_of(config.actuators[error.index]) : place_of(config.effectors[error.index]);
  const auto key = is_actuator ? actuator_key : effector_key;
  refuse(config, place.line, fmt::format("{}: {}", key(config, error.index, place.key), error.reason));
}

std::unique_ptr<Robot> build(const Config& config, fem::Model body) {
  const auto actuators = attach_actuators(body, config);
  const auto effectors = attach_effectors(body, config);
  try {
    return std::make_unique<Robot>(std::move(body), actuators, effectors);
  } catch (const fem::ConstraintError& error) {
    refuse(config, error);
  }
}

int64_t nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

}  // namespace

Robot::Robot(fem::Model body, const std::vector<fem::Actuator>& actuators,
             const std::vector<fem::Effector>& effectors)
    : model(std::move(body)), constraints(model, actuators, effectors) {
  for (const fem::Effector& effector : effectors) {
    const auto* points = std::get_if<fem::PointEffector>(&effector);
    effector_points.push_back(points ? points->points : std::vector<fem::Attachment>{});
  }
}

Eigen::Vector3d Robot::position(const Eigen::VectorXd& x, int effector) const {
  const std::vector<fem::Attachment>& points = effector_points[static_cast<std::size_t>(effector)];
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const fem::Attachment& point : points) sum += model.position(x, point);
  return sum / static_cast<double>(points.size());
}

std::unique_ptr<Robot> build_model(const Config& config) {
  return build(config, build_body(config, model_materials(config), config.loads));
}

std::unique_ptr<Robot> build_plant(const Config& config) {
  if (!config.plant)
    throw ConfigError(
        fmt::format("{}: plant: the section is missing; it says what the simulated robot is made of",
                    config.file.string()));
  std::vector<LoadConfig> loads = config.loads;
  loads.insert(loads.end(), config.plant->loads.begin(), config.plant->loads.end());
  return build(config, build_body(config, plant_materials(config), loads));
}

hal::DisplacementUnit displacement_unit(const ActuatorConfig& actuator) {
  return actuator.is_cavity() ? hal::DisplacementUnit{"ml", 1e6} : hal::DisplacementUnit{"mm", 1e3};
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

std::vector<int> tip_axes(const Config& config) {
  std::vector<int> axes;
  for (const EffectorRow& row : effector_rows(config))
    if (row.effector == 0) axes.push_back(row.axis);
  return axes;
}

std::vector<rt::MeasuredCoordinate> measured_coordinates(const Config& config) {
  std::vector<rt::MeasuredCoordinate> result;
  if (!config.control.feedback) return result;
  const auto rows = effector_rows(config);
  for (const Reading& reading : readings(config)) {
    const auto row = std::ranges::find_if(rows, [&measures = reading.measures](const EffectorRow& r) {
      return r.effector == measures.effector && r.axis == measures.axis;
    });
    if (row != rows.end())
      result.push_back({static_cast<int>(row - rows.begin()), reading.sensor, reading.signal});
  }
  return result;
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
    result.follows_effort[a] = actuator.follows_effort();
  }
  const auto e = static_cast<Eigen::Index>(rows.size());
  result.workspace_min.setZero(e);  // of volumes
  result.workspace_max.setConstant(e, std::numeric_limits<double>::infinity());
  for (Eigen::Index r = 0; r < e; ++r) {
    if (!rows[r].is_position()) continue;
    result.workspace_min[r] = config.control.workspace_min[rows[r].axis];
    result.workspace_max[r] = config.control.workspace_max[rows[r].axis];
  }
  result.iteration_cap = config.control.iteration_cap.value_or(useful_iterations(result.actuators));
  result.period_s = 1 / config.control.rate_hz;
  result.snapshot_age_limit_ns = nanoseconds(config.control.snapshot_age_limit);
  result.target_age_limit_ns = nanoseconds(config.control.target_age_limit);
  result.disable_limit_ns = config.bus.master.disable_timeout_ns;
  result.late_cycles_limit = config.control.late_cycles_limit;
  result.stop = config.control.stop;
  result.feedback = {measured_coordinates(config), result.period_s, config.control.feedback_time,
                     config.control.feedback_limit};
  return result;
}

}  // namespace tendril::app
