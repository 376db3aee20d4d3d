// SPDX-License-Identifier: Apache-2.0
#include "app/robot/robot_geometry.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/config/utf8.h"
#include "app/robot/body.h"
#include "app/robot/place.h"
#include "fem/mesh/surface.h"

namespace tendril::app {
namespace {

using Json = nlohmann::ordered_json;

/// A position of the robot's frame, mm, to a tenth of a micrometre: more digits only make the document
/// longer.
Json mm(const Eigen::Vector3d& position) {
  Json result = Json::array();
  for (const double metres : position) result.push_back(std::round(1e7 * metres) / 1e4 + 0.0);
  return result;
}

Json numbers(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

class Describer {
 public:
  Describer(const Config& config, const fem::Mesh& mesh) : config_(config), mesh_(mesh) {}

  Json describe() {
    Json result;
    result["robot"] = config_.robot;
    result["nodes"] = mesh_.node_count();
    result["size_mm"] = mm(mesh_.nodes.rowwise().maxCoeff() - mesh_.nodes.rowwise().minCoeff());
    result["surface"] = surface();
    result["fixed_mm"] = Json::array();
    attempt([&] {
      for (const int node : nodes_of(config_, mesh_, config_.fixed, "fixed"))
        result["fixed_mm"].push_back(mm(mesh_.nodes.col(node)));
    });
    result["actuators"] = Json::array();
    for (int a = 0; a < static_cast<int>(config_.actuators.size()); ++a)
      result["actuators"].push_back(actuator(a));
    result["effectors"] = Json::array();
    for (int e = 0; e < static_cast<int>(config_.effectors.size()); ++e)
      result["effectors"].push_back(effector(e));
    result["loads"] = Json::array();
    for (const LoadConfig& load : config_.loads)
      result["loads"].push_back({{"point", point(load.at, "loads")}, {"force_N", numbers(load.force)}});
    result["workspace_mm"] = workspace();
    result["motion"] = motion();
    result["gravity_m_per_s2"] = numbers(config_.gravity);
    result["problems"] = problems_;
    return result;
  }

 private:
  /// @return  whether it worked; else the document has one problem more
  bool attempt(const auto& what) {
    try {
      what();
      return true;
    } catch (const ConfigError& error) {
      std::string text = error.what();
      const std::string file = config_.file.string();
      if (text.starts_with(file)) text.replace(0, file.size(), config_.file.filename().string());
      problems_.push_back(text);
      return false;
    }
  }

  Json surface() {
    const auto outside = fem::boundary(mesh_);
    Json nodes = Json::array();
    place_of_node_.assign(static_cast<std::size_t>(mesh_.node_count()), -1);
    for (const int node : fem::nodes_of(outside)) {
      place_of_node_[static_cast<std::size_t>(node)] = static_cast<int>(nodes.size());
      nodes.push_back(mm(mesh_.nodes.col(node)));
    }
    return {{"nodes_mm", nodes}, {"faces", faces(outside)}};
  }

  Json faces(const std::vector<fem::Face>& triangles) const {
    Json result = Json::array();
    for (const auto& [a, b, c] : triangles)
      result.push_back({place_of_node_[static_cast<std::size_t>(a)],
                        place_of_node_[static_cast<std::size_t>(b)],
                        place_of_node_[static_cast<std::size_t>(c)]});
    return result;
  }

  Json point(const PointConfig& point, const std::string& key) {
    Eigen::Vector3d at = point.at;
    const bool fits = !point.on_body || attempt([&] {
      const fem::Attachment attachment = attach(mesh_, config_, point, key);
      at.setZero();
      for (std::size_t k = 0; k < 4; ++k) at += attachment.weights[k] * mesh_.nodes.col(attachment.nodes[k]);
    });
    Json result{{"at_mm", mm(at)}, {"on_body", point.on_body}};
    if (!fits) result["misplaced"] = true;
    return result;
  }

  Json points(const std::vector<PointConfig>& places, const std::string& key) {
    Json result = Json::array();
    for (const PointConfig& place : places) result.push_back(point(place, key));
    return result;
  }

  Json cavity(const RegionConfig& region, const std::string& key) {
    Json result = Json::array();
    attempt([&] { result = faces(wall(mesh_, config_, region, key)); });
    return result;
  }

  Json actuator(int index) {
    const ActuatorConfig& actuator = config_.actuators[static_cast<std::size_t>(index)];
    const Place place = place_of(actuator);
    const std::string key = actuator_key(config_, index, place.key);
    Json result{{"name", actuator.name},
                {"kind", place.key},
                {"effort_limits", {actuator.effort_min, actuator.effort_max}},
                {"displacement_limits", {actuator.displacement_min, actuator.displacement_max}}};
    if (!actuator.is_cavity()) result["points"] = points(points_of(actuator), key);
    if (const auto* force = std::get_if<ForceConfig>(&actuator.kind))
      result["direction"] = numbers(force->direction);
    if (const auto* filled = std::get_if<CavityConfig>(&actuator.kind))
      result["faces"] = cavity(filled->region, key);
    return result;
  }

  Json effector(int index) {
    const EffectorConfig& effector = config_.effectors[static_cast<std::size_t>(index)];
    const std::string key = effector_key(config_, index, place_of(effector).key);
    if (effector.cavity) return {{"name", effector.name}, {"faces", cavity(*effector.cavity, key)}};
    std::string coordinates;
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (effector.controlled[axis]) coordinates += "xyz"[axis];
    return {{"name", effector.name}, {"points", points(effector.points, key)}, {"coordinates", coordinates}};
  }

  /// The default is none that anyone wrote, and is far larger than a robot.
  Json workspace() const {
    const ControlConfig given_none;
    const ControlConfig& control = config_.control;
    if (control.workspace_min == given_none.workspace_min &&
        control.workspace_max == given_none.workspace_max)
      return nullptr;
    return {mm(control.workspace_min), mm(control.workspace_max)};
  }

  Json motion() const {
    if (!config_.motion) return nullptr;
    const MotionConfig& motion = *config_.motion;
    Json waypoints = Json::array();
    for (const Eigen::Vector3d& waypoint : motion.waypoints)
      waypoints.push_back(mm(motion.origin + waypoint));
    return {{"effector", config_.effectors[static_cast<std::size_t>(motion.effector)].name},
            {"origin_mm", mm(motion.origin)},
            {"waypoints_mm", waypoints},
            {"closed", motion.closed}};
  }

  const Config& config_;
  const fem::Mesh& mesh_;
  std::vector<int> place_of_node_;  // in the surface's nodes; -1: none of them
  Json problems_ = Json::array();
};

}  // namespace

std::string robot_geometry(const Config& config, const fem::Mesh& mesh) {
  return to_text(Describer(config, mesh).describe());
}

}  // namespace tendril::app
