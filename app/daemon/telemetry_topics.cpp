// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/telemetry_topics.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/config/readings.h"
#include "app/daemon/reaction_name.h"
#include "app/robot/robot.h"
#include "rt/faults.h"

namespace tendril::app {
namespace {

using nlohmann::ordered_json;

constexpr const char* kCoordinates[] = {"x", "y", "z", "volume"};

void add_value(std::vector<ValueGroup>& groups, const std::string& group, const std::string& value,
               std::size_t place) {
  const std::string name = in_quotes(group);
  auto found = std::ranges::find(groups, name, &ValueGroup::name);
  if (found == groups.end()) found = groups.insert(groups.end(), {name, {}});
  found->values.emplace_back(in_quotes(value), place);
}

ordered_json value(const char* type, const std::string& description) {
  return {{"type", type}, {"description", description}};
}
ordered_json number(const std::string& description) { return value("number", description); }
ordered_json count(const std::string& description) { return value("integer", description); }
ordered_json object(const ordered_json& properties) {
  return {{"type", "object"}, {"properties", properties}};
}

/// Of groups of coordinates and efforts.
ordered_json object(const std::vector<ValueGroup>& groups, const Config& config, const char* per = "") {
  auto properties = ordered_json::object();
  for (const ValueGroup& group : groups) {
    const std::string name = ordered_json::parse(group.name);
    auto values = ordered_json::object();
    for (const auto& [value_name, place] : group.values) {
      const std::string of = ordered_json::parse(value_name);
      const auto actuator = std::ranges::find(config.actuators, name, &ActuatorConfig::name);
      const bool pressure = actuator != config.actuators.end() && actuator->is_cavity();
      const char* unit = of == "volume" ? "m³" : of == "effort" ? pressure ? "Pa" : "N" : "m";
      values[of] = number(fmt::format("{}{}", unit, per));
    }
    properties[name] = object(values);
  }
  return object(properties);
}

ordered_json actuators_schema(const Config& config) {
  auto actuators = ordered_json::object();
  for (const ActuatorConfig& actuator : config.actuators) {
    const char* unit = actuator.is_cavity() ? "m³" : "m";
    actuators[actuator.name] = object({
        {"command", number(fmt::format("{}, commanded displacement", unit))},
        {"displacement", number(fmt::format("{}, as the drive measures it", unit))},
        {"effort", number(fmt::format("{}, in the solution of the QP", actuator.is_cavity() ? "Pa" : "N"))},
    });
  }
  return object(actuators);
}

std::string fault_bits() {
  std::string text = "bits, by worth:";
  for (const rt::FaultRule& rule : rt::kFaultTable)
    text += fmt::format(" {} {};", 1u << static_cast<unsigned>(rule.fault), rule.words);
  return text;
}

ordered_json state_schema(const Config& config) {
  const auto coordinates = object(coordinate_groups(config), config);
  return object({
      {"phase", value("string", "connect, model, enable, approach, run, stop, disable, stopped")},
      {"faults", count(fault_bits())},
      {"target", coordinates},
      {"model", coordinates},
      {"actuators", actuators_schema(config)},
      {"qp", object({{"status", value("string", "optimal, softened, capped, ill-posed; null: none solved")},
                     {"iterations", count("1")}})},
      {"snapshot", object({{"sequence", count("0: none yet")}, {"age", number("s, of its pose")}})},
      {"timing", object({{"wakeup", number("s, from the intended to the actual wake-up")},
                         {"read", number("s, taking in what the bus has brought")},
                         {"solve", number("s, snapshot, target and QP")},
                         {"work", number("s, from the wake-up to the end of the cycle's work")}})},
      {"cycles", count("deadlines that have passed, missed ones included")},
      {"late_cycles", count("of these, the missed ones")},
      {"missed", count("of these, those that this cycle made late")},
      {"bus_bits", count("bit, of the frames read and written")},
      {"heap_calls", count("of the control thread so far")},
      {"page_faults", count("of the control thread so far, minor and major")},
  });
}

ordered_json targets_schema(const Config& config) {
  const auto coordinates = coordinate_groups(config);
  return object({{"mode", value("string", "none, path, paused, target, hold")},
                 {"path_rate", number("1, share of the path's speed")},
                 {"position", object(coordinates, config)},
                 {"velocity", object(coordinates, config, "/s")}});
}

ordered_json snapshots_schema() {
  return object({{"sequence", count("1 for the first")},
                 {"age", number("s, of its pose when the control thread used it first")},
                 {"interval", number("s, from the pose of the one used before")},
                 {"iterations", count("of the first QP on it")}});
}

ordered_json errors_schema(const Config& config) {
  auto efforts = ordered_json::object();
  for (const ActuatorConfig& actuator : config.actuators)
    efforts[actuator.name] = number(actuator.is_cavity() ? "Pa" : "N");
  return object({{"tip", object({{"to_path", number("m, from the measured tip to where it was wanted")},
                                 {"to_model", number("m, from the measured tip to the model's")}})},
                 {"effort", object(efforts)}});
}

ordered_json status_schema(const Config& config) {
  auto sensors = ordered_json::object();
  for (const SensorConfig& sensor : config.sensors)
    sensors[sensor.frame.name] = object({{"lost", value("boolean", "at present")},
                                         {"losses", count("so far")},
                                         {"stale", number("s, in all")}});
  return object({{"model_refreshes", count("so far")},
                 {"model_failures", count("so far, refreshes that found no pose")},
                 {"model_rate", number("1/s, mean over the run")},
                 {"trace_dropped", count("cycles that are missing from the log: housekeeping was too slow")},
                 {"log_dropped", count("messages that are missing from the log: the disk was too slow")},
                 {"sensors", object(sensors)}});
}

ordered_json end_schema() {
  return object({{"stop_reason", value("string", "empty: the run ended as asked")},
                 {"policy", value("string", "scheduling of the control thread")},
                 {"priority", count("of it")},
                 {"heap_calls", count("of it; -1 where they cannot be counted")},
                 {"major_faults", count("page faults of it")},
                 {"minor_faults", count("page faults of it")},
                 {"bus_dropped", count("frames that found a queue full")}});
}

/// As viewers know it for lines of a log.
ordered_json log_schema() {
  return object({{"timestamp", object({{"sec", count("s")}, {"nsec", count("ns")}})},
                 {"level", count("2 info, 3 warning, 4 error")},
                 {"message", value("string", "")},
                 {"name", value("string", "the program")},
                 {"file", value("string", "")},
                 {"line", count("")}});
}

}  // namespace

std::string in_quotes(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::vector<ValueGroup> coordinate_groups(const Config& config) {
  std::vector<ValueGroup> groups;
  std::size_t place = 0;
  for (const EffectorRow& row : effector_rows(config))
    add_value(groups, config.effectors[row.effector].name, kCoordinates[row.axis], place++);
  return groups;
}

std::vector<std::vector<ValueGroup>> sensor_groups(const Config& config) {
  std::vector<std::vector<ValueGroup>> sensors(config.sensors.size());
  for (const auto& [sensor, signal, measures] : readings(config))
    if (measures.actuator >= 0)
      add_value(sensors[sensor], config.actuators[measures.actuator].name, "effort", signal);
    else
      add_value(sensors[sensor], config.effectors[measures.effector].name, kCoordinates[measures.axis],
                signal);
  return sensors;
}

McapContent telemetry_content(const Config& config, const RunFacts& facts, int64_t offset_ns) {
  McapContent content;
  content.library = "tendrild " TENDRIL_VERSION;
  const auto add = [&content](const std::string& topic, const std::string& name, ordered_json schema) {
    schema["title"] = name;
    content.schemas.push_back({name, "jsonschema", schema.dump()});
    content.channels.push_back({topic, "json", static_cast<uint16_t>(content.schemas.size())});
  };
  add("/state", "tendril.State", state_schema(config));
  add("/targets", "tendril.Target", targets_schema(config));
  add("/snapshots", "tendril.Snapshot", snapshots_schema());
  add("/errors", "tendril.Errors", errors_schema(config));
  add("/status", "tendril.Status", status_schema(config));
  add("/log", "foxglove.Log", log_schema());
  add("/end", "tendril.End", end_schema());
  const auto groups = sensor_groups(config);
  for (std::size_t s = 0; s < config.sensors.size(); ++s) {
    const std::string& name = config.sensors[s].frame.name;
    add("/sensors/" + name, "tendril.Sensor." + name, object(groups[s], config));
  }

  content.metadata.push_back({"run",
                              {{"robot", config.robot},
                               {"configuration", config.file.string()},
                               {"tip", config.effectors.empty() ? "" : config.effectors[0].name},
                               {"nodes", std::to_string(facts.nodes)},
                               {"tetrahedra", std::to_string(facts.tetrahedra)},
                               {"effector_dofs", std::to_string(effector_rows(config).size())},
                               {"bus", facts.bus},
                               {"bitrate", fmt::format("{}", config.bus.bitrate)},
                               {"control_rate_hz", fmt::format("{}", config.control.rate_hz)},
                               {"iteration_cap", std::to_string(facts.iteration_cap)},
                               {"memory_locked", facts.memory_locked ? "true" : "false"},
                               {"monotonic_offset_ns", std::to_string(offset_ns)}}});
  McapMetadata units{"effort_units", {}};
  for (const ActuatorConfig& actuator : config.actuators)
    units.values[actuator.name] = actuator.is_cavity() ? "Pa" : "N";
  content.metadata.push_back(units);
  McapMetadata faults{"faults", {}};
  for (const rt::FaultRule& rule : rt::kFaultTable)
    faults.values[std::to_string(1u << static_cast<unsigned>(rule.fault))] =
        fmt::format("{}: {}", name(rule.reaction), rule.words);
  content.metadata.push_back(faults);
  return content;
}

}  // namespace tendril::app
