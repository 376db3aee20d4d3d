// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/check/path_check.h"
#include "app/robot/robot.h"

namespace tendril::app {
namespace {

std::string covered_part(const Config& config, const PathCheck& path) {
  if (path.covered_s <= 0) return "nothing of the path itself";
  if (!path.whole()) return fmt::format("the first {:.3g} s of {:.4g} s", path.covered_s, path.round_s);
  if (path.covered_s > 1.01 * path.round_s)
    return fmt::format("{:.1f} rounds of {:.3g} s", path.covered_s / path.round_s, path.round_s);
  return fmt::format("{} {:.3g} s", config.motion->closed ? "one round of" : "all of its", path.round_s);
}

std::string coverage(const Config& config, const PathCheck& path) {
  return fmt::format("simulated: {:.3g} s of approach and {}, the model at {:g} Hz", path.approach_s,
                     covered_part(config, path), path.model_rate_hz);
}

/// The path's speed at which no actuator would be asked for more than it can, m/s; none where that is not
/// known.
std::optional<double> possible_speed(const Config& config, const PathCheck& path) {
  double share = 1;
  for (std::size_t a = 0; a < path.actuators.size(); ++a)
    if (path.actuators[a].asked_speed)
      share = std::min(share, config.actuators[a].top_rate / *path.actuators[a].asked_speed);
  return share < 1 ? std::optional(share * config.motion->speed) : std::nullopt;
}

std::string advice_on_speed(const Config& config, std::size_t a, const ActuatorDemand& demand) {
  const ActuatorConfig& actuator = config.actuators[a];
  const hal::DisplacementUnit unit = displacement_unit(actuator);
  const char* key = actuator.is_cavity() ? "top_flow" : "top_speed";
  std::string text = fmt::format("'{}' moves at its {}, {:.3g} {}/s, for {:.2f} s, first {}", actuator.name,
                                 key, unit.per_si * actuator.top_rate, unit.name, demand.at_top_speed_s,
                                 describe(*demand.first, config));
  if (demand.asked_speed && *demand.asked_speed > actuator.top_rate)
    text +=
        fmt::format("; the path asks up to {:.3g} {}/s of it", unit.per_si * *demand.asked_speed, unit.name);
  return text;
}

nlohmann::ordered_json json_of(const PathInstant& instant) {
  return {{"t_s", instant.time_s}, {"to_waypoint", instant.part.to}, {"approach", instant.part.approach}};
}

}  // namespace

std::string describe(const PathInstant& instant, const Config& config) {
  if (instant.part.approach)
    return fmt::format("on the approach, {:.2f} s before waypoint 0", -instant.time_s);
  const std::size_t count = config.motion->waypoints.size(), to = instant.part.to;
  return fmt::format("at {:.2f} s, on the way from waypoint {} to {}", instant.time_s,
                     (to + count - 1) % count, to);
}

std::string verdict(const Config& config, const PathCheck& path) {
  const std::string covered = coverage(config, path);
  if (!path.started) return "not simulated: the simulated drives do not start: " + path.stop_reason;
  if (!path.stop_reason.empty())
    return fmt::format("THE RUN STOPS after {:.2f} s of the path: {}; {}", path.covered_s, path.stop_reason,
                       covered);
  if (path.follows())
    return fmt::format("the model stays within {:.2f} mm of the target, {:.2f} mm in the mean; {}",
                       1e3 * path.error_max, 1e3 * path.error_mean, covered);
  return fmt::format(
      "OFF THE PATH: the model is up to {:.2f} mm from the target, {}; more than {:g} mm first {}; {}; {}",
      1e3 * path.error_max, describe(path.worst, config), 1e3 * kReached, describe(*path.first_off, config),
      path.at_limits.empty() ? "no actuator is at a limit there" : describe(path.at_limits), covered);
}

std::vector<std::string> advice_on_path(const Config& config, const PathCheck& path) {
  std::vector<std::string> advice;
  for (std::size_t a = 0; a < path.actuators.size(); ++a)
    if (path.actuators[a].asked_speed) advice.push_back(advice_on_speed(config, a, path.actuators[a]));
  if (const auto speed = possible_speed(config, path))
    advice.push_back(
        fmt::format("motion.speed {:.3g} mm/s is more than the actuators can do: lower it to "
                    "about {:.2g} mm/s, or raise their top speeds",
                    1e3 * config.motion->speed, 1e3 * *speed));
  if (path.approach_error_max > kReached)
    advice.push_back(fmt::format("on the approach to the path the model is up to {:.2f} mm from the target",
                                 1e3 * path.approach_error_max));
  for (const PathFault& fault : path.faults)
    advice.push_back(fmt::format("on the path: {} ({} cycles), first {}", rt::rule(fault.fault).words,
                                 fault.cycles, describe(fault.first, config)));
  return advice;
}

nlohmann::ordered_json json_of(const Config& config, const PathCheck& path) {
  nlohmann::ordered_json json;
  json["follows"] = path.follows();
  json["model_rate_hz"] = path.model_rate_hz;
  json["approach_s"] = path.approach_s;
  json["round_s"] = path.round_s;
  json["covered_s"] = path.covered_s;
  json["target_to_model_mm"] = {{"mean", 1e3 * path.error_mean}, {"max", 1e3 * path.error_max}};
  json["approach_to_model_mm"] = 1e3 * path.approach_error_max;
  json["worst"] = json_of(path.worst);
  json["first_off"] = path.first_off ? json_of(*path.first_off) : nlohmann::ordered_json();
  json["at_limits"] = json_of(path.at_limits);
  json["actuators"] = nlohmann::ordered_json::object();
  for (std::size_t a = 0; a < path.actuators.size(); ++a) {
    const ActuatorDemand& demand = path.actuators[a];
    nlohmann::ordered_json& entry = json["actuators"][config.actuators[a].name];
    const hal::DisplacementUnit unit = displacement_unit(config.actuators[a]);
    entry = {{"greatest_speed", unit.per_si * demand.top_speed},
             {"top_speed", unit.per_si * config.actuators[a].top_rate},
             {"at_top_speed_s", demand.at_top_speed_s},
             {"unit", std::string(unit.name) + "/s"}};
    if (demand.asked_speed) entry["asked_speed"] = unit.per_si * *demand.asked_speed;
    if (demand.first) entry["first"] = json_of(*demand.first);
  }
  json["faults"] = nlohmann::ordered_json::array();
  for (const PathFault& fault : path.faults)
    json["faults"].push_back(
        {{"words", rt::rule(fault.fault).words}, {"cycles", fault.cycles}, {"first", json_of(fault.first)}});
  json["stop_reason"] = path.stop_reason;
  return json;
}

}  // namespace tendril::app
