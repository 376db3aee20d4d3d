// SPDX-License-Identifier: Apache-2.0
#include "app/config/config_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "app/config/config_error.h"
#include "app/config/config_sensors.h"
#include "app/config/master_config.h"
#include "hal/drive/drive_protocol.h"

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

/// @param key  "homing.timeout" lies in the section "homing"
[[noreturn]] void fail_at(const Value& section, std::string_view key, const std::string& expected) {
  const auto dot = key.find('.');
  if (dot == key.npos) section.at(key).fail(expected);
  fail_at(section.at(key.substr(0, dot)), key.substr(dot + 1), expected);
}

Value section_of(const Value& robot, const hal::SettingError& error) {
  const auto index = static_cast<std::size_t>(error.index);
  switch (error.section) {
    case hal::SettingError::Section::kDrive:
      return robot.at("actuators").at(index).at("drive");
    case hal::SettingError::Section::kSensor:
      return robot.at("sensors").at(index);
    case hal::SettingError::Section::kBus:
      break;
  }
  return robot.at("bus");
}

/// What the protocol of the drives demands.
void check_drives(const Value& robot, const Config& config) {
  try {
    config.bus.master.protocol->check(master_config(config));
  } catch (const hal::SettingError& error) {
    fail_at(section_of(robot, error), error.key, error.expected);
  } catch (const std::invalid_argument& error) {
    throw ConfigError(fmt::format("{}:{}: bus: {}", config.file.string(), config.bus.line, error.what()));
  }
}

/// One whose coordinates all have weight 0 goes where the others leave it.
void check_follower(const Value& robot, const Config& config) {
  const EffectorConfig& follower = config.effectors[static_cast<std::size_t>(config.motion->effector)];
  if (std::ranges::all_of(follower.weights, [](double weight) { return weight <= 0; }))
    robot.at("motion")
        .at("effector")
        .fail(fmt::format(
            "an effector with a weight above 0; the weights of '{}' are 0, so it is not controlled",
            follower.name));
}

/// A speed that is mistyped by orders of magnitude.
void check_speed(const Value& robot, const MotionConfig& motion) {
  constexpr double kLongest_s = 30 * 86'400.0;
  double length = motion.waypoints.front().norm();  // about as far as the approach
  for (std::size_t k = 1; k < motion.waypoints.size(); ++k)
    length += (motion.waypoints[k] - motion.waypoints[k - 1]).norm();
  const double seconds = length / motion.speed;
  if (seconds > kLongest_s)
    robot.at("motion").at("speed").fail(
        fmt::format("at least {:.3g} mm/s: with this one the path takes {:.3g} days, and 30 are allowed",
                    1e3 * length / kLongest_s, seconds / 86'400));
}

bool in_workspace(const ControlConfig& control, const Eigen::Vector3d& p) {
  constexpr double kRounding = 1e-9;  // m; 0.1 + 0.2 is above 0.3 in binary
  return (p.array() >= control.workspace_min.array() - kRounding).all() &&
         (p.array() <= control.workspace_max.array() + kRounding).all();
}

/// Straight ways between waypoints stay inside where these are; a curve reaches as far as its amplitudes.
void check_in_workspace(const Value& robot, const Config& config) {
  const MotionConfig& motion = *config.motion;
  const Value section = robot.at("motion"), waypoints = section.at("waypoints");
  const auto expected = [](const char* what, const Eigen::Vector3d& p) {
    return fmt::format("{} in control.workspace; with the origin it is at {:g} {:g} {:g} m", what, p.x(),
                       p.y(), p.z());
  };
  if (!waypoints.is_list()) {
    const Eigen::Vector3d reach = motion.curve ? motion.curve->amplitude : motion.waypoints[0].cwiseAbs();
    for (const double side : {-1.0, 1.0})
      if (const Eigen::Vector3d p = motion.origin + side * reach; !in_workspace(config.control, p))
        section.at("size").fail(expected("a shape", p));
    return;
  }
  for (std::size_t i = 0; i < motion.waypoints.size(); ++i)
    if (const Eigen::Vector3d p = motion.origin + motion.waypoints[i]; !in_workspace(config.control, p))
      waypoints.at(i).fail(expected("a waypoint", p));
}

void check_motion(const Value& robot, const Config& config) {
  if (!config.motion) return;
  check_follower(robot, config);
  check_speed(robot, *config.motion);
  check_in_workspace(robot, config);
}

void check_feedback(const Value& robot, const Config& config) {
  if (!config.control.feedback) return;
  for (const SensorConfig& sensor : config.sensors)
    for (const MeasuredConfig& measured : sensor.measures)
      if (measured.effector >= 0) return;
  robot.at("control").at("feedback").fail("off, as no sensor measures an effector");
}

}  // namespace

void check_rules(const Value& robot, const Config& config) {
  check_capacity(robot, config);
  check_names(robot);
  check_first_effector(robot, config);
  check_material(robot, config);
  check_actuators(robot, config);
  check_sensors(robot, config);
  check_feedback(robot, config);
  check_drives(robot, config);
  check_motion(robot, config);
}

}  // namespace tendril::app
