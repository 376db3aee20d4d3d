#include "app/robot.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <numbers>

#include "fem/mesh_reader.h"

namespace tendril::app {
namespace {

[[noreturn]] void refuse(const Config& config, int line, const std::string& what) {
  throw ConfigError(fmt::format("{}:{}: {}", config.file.string(), line, what));
}

fem::Mesh load_mesh(const Config& config) {
  const auto refuse_mesh = [&](const std::string& what) {
    throw ConfigError(fmt::format("{}: mesh: {}", config.file.string(), what));
  };
  fem::Mesh mesh;
  try {
    mesh = fem::read_mesh(config.mesh.file, config.mesh.unit);
  } catch (const fem::MeshError& error) {  // names the mesh file itself
    refuse_mesh(error.what());
  }
  mesh.nodes = (config.mesh.rotation * mesh.nodes).colwise() + config.mesh.translation;
  try {
    fem::check(mesh);
  } catch (const fem::MeshError& error) {
    refuse_mesh(fmt::format("{}: {}", config.mesh.file.string(), error.what()));
  }
  return mesh;
}

std::vector<int> fixed_nodes(const Config& config, const fem::Mesh& mesh) {
  const FixedConfig& fixed = config.fixed;
  if (fixed.region.empty()) {
    auto nodes = fem::nodes_in(mesh, fem::Box{fixed.box_min, fixed.box_max});
    if (nodes.empty()) refuse(config, fixed.line, "fixed.box: found no node of the mesh inside");
    return nodes;
  }
  const auto region = mesh.regions.find(fixed.region);
  if (region != mesh.regions.end()) return region->second;
  std::vector<std::string> names;
  for (const auto& entry : mesh.regions) names.push_back(entry.first);
  refuse(config, fixed.line,
         fmt::format("fixed: found '{}', expected a region of {}: {}", fixed.region,
                     config.mesh.file.filename().string(),
                     names.empty() ? "it has none; use a box" : fmt::format("{}", fmt::join(names, ", "))));
}

fem::Model build_body(const Config& config, const fem::Material& material, const fem::Mass& mass) {
  const fem::Mesh mesh = load_mesh(config);
  const auto fixed = fixed_nodes(config, mesh);
  try {
    return {mesh, material, mass, fixed, config.gravity};
  } catch (const std::exception& error) {
    throw ConfigError(fmt::format("{}:{}: fixed: {}", config.file.string(), config.fixed.line, error.what()));
  }
}

fem::Attachment attach(const fem::Model& model, const Config& config, const PointConfig& point,
                       const std::string& key) {
  try {
    return fem::attach(model.mesh(), point.at, config.snap);
  } catch (const fem::MeshError& error) {
    refuse(config, point.line,
           fmt::format("{}: {}; move it there or allow more with 'snap'", key, error.what()));
  }
}

std::vector<fem::Actuator> attach_cables(const fem::Model& model, const Config& config) {
  std::vector<fem::Actuator> result;
  for (const CableConfig& cable : config.cables) {
    fem::Cable attached;
    for (const PointConfig& point : cable.points)
      if (point.on_body)
        attached.points.emplace_back(attach(model, config, point, fmt::format("cable '{}'", cable.name)));
      else
        attached.points.emplace_back(point.at);
    result.push_back(attached);
  }
  return result;
}

std::vector<fem::Effector> attach_effectors(const fem::Model& model, const Config& config) {
  std::vector<fem::Effector> result;
  for (const EffectorConfig& effector : config.effectors)
    result.push_back(fem::PointEffector{
        {attach(model, config, effector.point, fmt::format("effector '{}'", effector.name))},
        effector.controlled});
  return result;
}

std::unique_ptr<Robot> build(const Config& config, const fem::Material& material, const fem::Mass& mass) {
  fem::Model body = build_body(config, material, mass);
  const auto cables = attach_cables(body, config);
  const auto effectors = attach_effectors(body, config);
  try {
    return std::make_unique<Robot>(std::move(body), cables, effectors);
  } catch (const std::invalid_argument& error) {
    throw ConfigError(fmt::format("{}: {}", config.file.string(), error.what()));
  }
}

std::int64_t nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

}  // namespace

Robot::Robot(fem::Model body, const std::vector<fem::Actuator>& actuators,
             const std::vector<fem::Effector>& effectors)
    : model(std::move(body)),
      tip_attachment(std::get<fem::PointEffector>(effectors.at(0)).points.at(0)),
      constraints(model, actuators, effectors) {}

std::unique_ptr<Robot> build_model(const Config& config) {
  const MaterialConfig& m = config.material;
  return build(config, {m.young_modulus, m.poisson_ratio}, {m.mass, m.mass_per_node});
}

std::unique_ptr<Robot> build_plant(const Config& config) {
  if (!config.plant)
    throw ConfigError(
        fmt::format("{}: plant: the section is missing; it says what the simulated robot is made of",
                    config.file.string()));
  const PlantConfig& p = *config.plant;
  return build(config, {p.young_modulus, p.poisson_ratio}, {p.mass, config.material.mass_per_node});
}

std::vector<EffectorRow> effector_rows(const Config& config) {
  std::vector<EffectorRow> rows;
  for (int effector = 0; effector < static_cast<int>(config.effectors.size()); ++effector)
    for (int axis = 0; axis < 3; ++axis)
      if (config.effectors[effector].controlled[axis]) rows.push_back({effector, axis});
  return rows;
}

rt::ControllerConfig controller_config(const Config& config) {
  const auto m = static_cast<Eigen::Index>(config.cables.size());
  const auto rows = effector_rows(config);
  rt::ControllerConfig result;
  result.actuators = static_cast<int>(m);
  result.effector_coordinates = static_cast<int>(rows.size());
  for (auto* v : {&result.a_min, &result.a_max, &result.l_min, &result.l_max, &result.v_max}) v->resize(m);
  for (Eigen::Index a = 0; a < m; ++a) {
    const CableConfig& cable = config.cables[a];
    result.a_min[a] = cable.tension_min;
    result.a_max[a] = cable.tension_max;
    result.l_min[a] = cable.stroke_min;
    result.l_max[a] = cable.stroke_max;
    result.v_max[a] = cable.top_speed;
  }
  result.workspace_min.resize(rows.size());
  result.workspace_max.resize(rows.size());
  for (size_t r = 0; r < rows.size(); ++r) {
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
  for (const CableConfig& cable : config.cables) {
    hal::AxisConfig axis;
    axis.name = cable.name;
    axis.node = cable.drive.node;
    axis.scale = {cable.drive.counts_per_turn, 2 * std::numbers::pi * cable.drive.pulley_radius,
                  cable.drive.reversed};
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
