#include "app/config/config_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "app/config/config_sensors.h"
#include "hal/cia402/cia402.h"
#include "hal/odrive/odrive.h"

namespace tendril::app {
namespace {

void check_capacity(const Value& robot, const Config& config) {
  int coordinates = 0, weighed = 0;
  for (const EffectorConfig& effector : config.effectors) {
    coordinates += effector.coordinates();
    weighed += int(std::ranges::count_if(effector.weights, [](double weight) { return weight > 0; }));
  }
  const int actuators = int(config.actuators.size());
  if (actuators > kMaxActuators)
    robot.at("actuators").fail(fmt::format("at most {} actuators", kMaxActuators));
  if (coordinates > kMaxEffectorCoordinates) {
    const Value effectors = robot.at("effectors");
    effectors.fail(
        fmt::format("at most {} controlled coordinates, these are {}", kMaxEffectorCoordinates, coordinates));
  }
  if (weighed == 0) robot.at("effectors").fail("a coordinate with a weight above 0");
}

/// Trace and report are about a point.
void check_first_effector(const Value& robot, const Config& config) {
  if (config.effectors[0].cavity)
    robot.at("effectors")
        .at(std::size_t{0})
        .at("cavity")
        .fail("a point or points first, as the report follows the first effector");
}

void check_material(const Value& robot, const Config& config) {
  double mass = 0;
  for (std::size_t k = 0; k < config.material.regions.size(); ++k) {
    mass += config.material.regions[k].mass.value_or(0);
    if (mass <= config.material.mass) continue;
    const Value place = robot.at("material").at("regions").at(k).at("mass");
    place.fail(fmt::format("parts no heavier than the whole; with this one they have {:g} kg of {:g} kg",
                           mass, config.material.mass));
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

constexpr double kApart = 1e-6;  // m; closer points give no direction

void check_kind(const Value& actuator, const CableConfig& cable) {
  const std::vector<PointConfig>& points = cable.points;
  const Value place = actuator.at("cable");
  if (points.size() < 2) place.fail("at least two points, the attachment and a guide");
  if (!points[0].on_body) place.at(std::size_t{0}).fail("the attachment first, as in 'body 0 97 45 mm'");
  for (std::size_t p = 1; p < points.size(); ++p) {
    if ((points[p].at - points[p - 1].at).norm() < kApart)
      place.at(p).fail("a point apart from the one before it");
  }
}

void check_kind(const Value& actuator, const RodConfig& rod) {
  const Value place = actuator.at("rod");
  if (!rod.from.on_body && !rod.to.on_body) place.fail("an end on the body, as in 'body 0 97 45 mm'");
  if ((rod.to.at - rod.from.at).norm() < kApart)
    place.at(std::size_t{1}).fail("a point apart from the other end");
}

void check_kind(const Value&, const ForceConfig&) {}
void check_kind(const Value&, const CavityConfig&) {}

void check_actuators(const Value& robot, const Config& config) {
  for (std::size_t i = 0; i < config.actuators.size(); ++i) {
    const Value actuator = robot.at("actuators").at(i);
    std::visit([&](const auto& kind) { check_kind(actuator, kind); }, config.actuators[i].kind);
  }
}

constexpr double kLargestTorque = 32.767;  // rated ones, object 6071, i16 in thousandths

/// @return the node ids in use
std::vector<int> check_nodes(const Value& robot, const Config& config) {
  std::vector<int> nodes;
  std::vector<std::string> owners;
  const auto add = [&](int node, const std::string& owner) {
    nodes.push_back(node);
    owners.push_back(owner);
  };
  if (config.bus.protocol != hal::Protocol::kOdrive) add(config.bus.master_node, "bus.master_node");
  for (std::size_t i = 0; i < config.actuators.size(); ++i) {
    const int node = config.actuators[i].drive.node;
    const Value place = robot.at("actuators").at(i).at("drive").at("node");
    if (config.bus.protocol == hal::Protocol::kOdrive && config.bus.firmware == hal::OdriveFirmware::k0_6 &&
        node == hal::kOdriveUnaddressed)
      place.fail("at most 62, as firmware 0.6 gives 63 to axes that have no address yet");
    const auto taken = std::ranges::find(nodes, node);
    if (taken != nodes.end()) {
      place.fail("a node id of its own, " + owners[taken - nodes.begin()] + " has this one");
    }
    add(node, fmt::format("actuators[{}].drive", i));
  }
  return nodes;
}

/// One frame carries both limits.
void check_limits(const Value& robot, const Config& config) {
  for (std::size_t i = 0; i < config.actuators.size(); ++i) {
    const DriveConfig& drive = config.actuators[i].drive;
    if ((drive.velocity_limit > 0) == (drive.current_limit > 0)) continue;
    const bool has_velocity = drive.velocity_limit > 0;
    const Value place =
        robot.at("actuators").at(i).at("drive").at(has_velocity ? "current_limit" : "velocity_limit");
    place.fail(has_velocity ? "a current limit beside the velocity limit"
                            : "a velocity limit beside the current limit");
  }
}

/// What an axis is told of homing has a use, and no start takes for the zero wherever the axis has got to.
/// Where the protocol cannot tell whether there is a reference, a person must.
void check_references(const Value& robot, const Config& config) {
  for (std::size_t i = 0; i < config.actuators.size(); ++i) {
    const hal::CanopenAxis& axis = config.actuators[i].drive.canopen;
    const Value place = robot.at("actuators").at(i).at("drive");
    if (config.bus.protocol == hal::Protocol::kOdrive) {
      if (!config.actuators[i].drive.counts_from_power_on)
        place.at("reference")
            .fail(
                "absolute, or power_on: does the axis still know where it stands when its power was off, or "
                "does it count from wherever it stands when the power comes? An ODrive does not tell");
    } else if (axis.reference != hal::Reference::kHoming) {
      if (place.at("homing").is_mapping()) place.at("reference").fail("homing, as there is a section for it");
    } else if (axis.homing.method && hal::homes_in_place(*axis.homing.method) && axis.referenced_bit < 0) {
      place.at("referenced_bit")
          .fail(fmt::format("the statusword bit that tells whether it has been done, as homing method {} "
                            "takes wherever the axis stands at a start for the zero",
                            *axis.homing.method));
    }
  }
}

/// A drive that is commanded torques knows what they are thousandths of, and has room for the largest.
void check_torques(const Value& drive, const ActuatorConfig& actuator) {
  const double rated = actuator.drive.canopen.rated_torque;
  if (!(rated > 0))
    drive.at("rated_torque").fail("the torque that the drive calls 1000, as drive.setpoint is effort");
  const double largest = std::max(std::abs(actuator.effort_min), std::abs(actuator.effort_max));
  const double torque = std::abs(actuator.drive.scale().to_torque(largest));
  if (torque > kLargestTorque * rated)
    drive.at("rated_torque")
        .fail(
            fmt::format("at least {:.4g} Nm, as the largest effort is a torque of {:.4g} Nm and object 6071 "
                        "holds 32.767 times the rated one",
                        torque / kLargestTorque, torque));
}

void check_set_points(const Value& robot, const Config& config) {
  for (std::size_t i = 0; i < config.actuators.size(); ++i) {
    const ActuatorConfig& actuator = config.actuators[i];
    const hal::CanopenAxis& axis = actuator.drive.canopen;
    const Value drive = robot.at("actuators").at(i).at("drive");
    if (!actuator.follows_effort()) {
      if (axis.rated_torque > 0)
        drive.at("rated_torque").fail("no such key, as drive.setpoint is displacement");
      continue;
    }
    if (axis.following_error > 0)
      drive.at("following_error").fail("no such key, as drive.setpoint is effort");
    if (config.bus.protocol != hal::Protocol::kOdrive) check_torques(drive, actuator);
  }
}

void check_bus(const Value& robot, const Config& config) {
  const BusConfig& bus = config.bus;
  // One late heartbeat is jitter, two are a fault.
  if (bus.heartbeat_timeout < 2 * bus.heartbeat) {
    const Value timeout = robot.at("bus").at("heartbeat_timeout");
    timeout.fail(
        fmt::format("at least two heartbeats, {} s (it is {} s)", 2 * bus.heartbeat, bus.heartbeat_timeout));
  }
  const double feedback_period =
      bus.protocol == hal::Protocol::kOdrive ? bus.encoder_period : 1 / config.control.rate_hz;
  if (bus.feedback_timeout < 2 * feedback_period) {
    const Value timeout = robot.at("bus").at("feedback_timeout");
    timeout.fail(fmt::format("at least two positions' time, {:g} s (it is {:g} s)", 2 * feedback_period,
                             bus.feedback_timeout));
  }
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

void check_rules(const Value& robot, const Config& config) {
  check_capacity(robot, config);
  check_names(robot);
  check_first_effector(robot, config);
  check_material(robot, config);
  check_actuators(robot, config);
  const std::vector<int> nodes = check_nodes(robot, config);
  check_limits(robot, config);
  check_references(robot, config);
  check_set_points(robot, config);
  check_bus(robot, config);
  check_sensors(robot, config, nodes);
  check_motion(robot, config);
}

}  // namespace tendril::app
