#include "app/config_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <vector>

namespace tendril::app {
namespace {

void check_capacity(const Value& robot, const Config& config) {
  int coordinates = 0;
  for (const EffectorConfig& effector : config.effectors) {
    coordinates += int(std::ranges::count(effector.controlled, true));
  }
  const int cables = int(config.cables.size());
  if (cables > kMaxActuators) robot.at("actuators").fail(fmt::format("at most {} actuators", kMaxActuators));
  if (coordinates > kMaxEffectorCoordinates) {
    const Value effectors = robot.at("effectors");
    effectors.fail(
        fmt::format("at most {} controlled coordinates, these are {}", kMaxEffectorCoordinates, coordinates));
  }
  // W_eaᵀ W_ea has no more than `coordinates` nonzero eigenvalues: without the energy term the QP is not
  // strictly convex.
  if (config.control.epsilon == 0 && cables > coordinates) {
    const Value epsilon = robot.at("control").at("epsilon");
    epsilon.fail(fmt::format("a number above 0, as {} actuators for {} effector coordinates are redundant",
                             cables, coordinates));
  }
}

/// Effectors and actuators share the columns of one table.
void check_names(const Value& robot) {
  std::map<std::string, std::string> owners;
  for (const char* const section : {"effectors", "actuators"}) {
    for (const Value& item : robot.at(section).items()) {
      const Value name = item.at("name");
      const auto [owner, is_new] = owners.emplace(name.text("a name"), item.path());
      if (!is_new) name.fail(fmt::format("a name of its own, {} has this one", owner->second));
    }
  }
}

/// A cable pulls its first point toward the next: two in one place give no direction.
void check_cables(const Value& robot, const Config& config) {
  constexpr double kApart = 1e-6;  // m
  for (std::size_t i = 0; i < config.cables.size(); ++i) {
    const std::vector<PointConfig>& points = config.cables[i].points;
    const Value cable = robot.at("actuators").at(i).at("cable");
    if (points.size() < 2) cable.fail("at least two points, the attachment and a guide");
    if (!points[0].on_body) cable.at(std::size_t{0}).fail("the attachment first, as in 'body 0 97 45 mm'");
    for (std::size_t p = 1; p < points.size(); ++p) {
      const double distance = (points[p].at - points[p - 1].at).norm();
      if (distance < kApart) cable.at(p).fail("a point apart from the one before it");
    }
  }
}

/// @return the node ids in use, the master's first
std::vector<int> check_nodes(const Value& robot, const Config& config) {
  std::vector<int> nodes = {config.bus.master_node};
  for (std::size_t i = 0; i < config.cables.size(); ++i) {
    const int node = config.cables[i].drive.node;
    const auto taken = std::ranges::find(nodes, node);
    if (taken != nodes.end()) {
      const auto owner = taken - nodes.begin() - 1;
      const Value place = robot.at("actuators").at(i).at("drive").at("node");
      place.fail("a node id of its own, " +
                 (owner < 0 ? "bus.master_node" : fmt::format("actuators[{}].drive", owner)) +
                 " has this one");
    }
    nodes.push_back(node);
  }
  return nodes;
}

void check_bus(const Value& robot, const Config& config, const std::vector<int>& nodes) {
  const BusConfig& bus = config.bus;
  // One late heartbeat is jitter, two are a fault.
  if (bus.heartbeat_timeout < 2 * bus.heartbeat) {
    const Value timeout = robot.at("bus").at("heartbeat_timeout");
    timeout.fail(
        fmt::format("at least two heartbeats, {} s (it is {} s)", 2 * bus.heartbeat, bus.heartbeat_timeout));
  }
  const std::string owner = bus.tracker_id == 0 ? "" : identifier_owner(bus.tracker_id, nodes);
  if (!owner.empty()) robot.at("bus").at("tracker").fail("an identifier that is free; this is " + owner);
}

void check_motion(const Value& robot, const Config& config) {
  if (!config.motion) return;
  constexpr double kRounding = 1e-9;  // m; 0.1 + 0.2 is above 0.3 in binary
  const ControlConfig& control = config.control;
  for (std::size_t i = 0; i < config.motion->waypoints.size(); ++i) {
    const Eigen::Vector3d p = config.motion->origin + config.motion->waypoints[i];
    if ((p.array() >= control.workspace_min.array() - kRounding).all() &&
        (p.array() <= control.workspace_max.array() + kRounding).all()) {
      continue;
    }
    const Value waypoint = robot.at("motion").at("waypoints").at(i);
    waypoint.fail(fmt::format("a waypoint in control.workspace; with the origin it is at {:g} {:g} {:g} m",
                              p.x(), p.y(), p.z()));
  }
}

}  // namespace

std::string identifier_owner(int identifier, const std::vector<int>& nodes) {
  if (identifier == 0x000) return "the NMT command";
  if (identifier == 0x080) return "SYNC";
  struct Function {
    int base;
    const char* name;
  };
  static constexpr Function kFunctions[] = {{0x080, "the emergency message"},
                                            {0x180, "TPDO 1"},
                                            {0x200, "RPDO 1"},
                                            {0x280, "TPDO 2"},
                                            {0x300, "RPDO 2"},
                                            {0x380, "TPDO 3"},
                                            {0x400, "RPDO 3"},
                                            {0x480, "TPDO 4"},
                                            {0x500, "RPDO 4"},
                                            {0x580, "the SDO answer"},
                                            {0x600, "the SDO request"},
                                            {0x700, "the heartbeat"}};
  const int node = identifier & 0x7F;
  if (std::ranges::find(nodes, node) == nodes.end()) return "";
  for (const auto& [base, name] : kFunctions) {
    if ((identifier & 0x780) == base) return fmt::format("{} of node {}", name, node);
  }
  return "";
}

void check_rules(const Value& robot, const Config& config) {
  check_capacity(robot, config);
  check_names(robot);
  check_cables(robot, config);
  const std::vector<int> nodes = check_nodes(robot, config);
  check_bus(robot, config, nodes);
  check_motion(robot, config);
}

}  // namespace tendril::app
