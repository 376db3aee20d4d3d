// SPDX-License-Identifier: Apache-2.0
#include "app/operation/control_request.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app/robot/robot.h"

namespace tendril::app {
namespace {

using nlohmann::json;

constexpr double kLongestWay_s = 600;
constexpr double kTopSpeed = 10;  // m/s
constexpr double kTopStateRate_hz = 1000;
constexpr double kTopSurfaceRate_hz = 30;

struct CommandRow {
  Command command;
  const char* name;
  std::vector<const char*> keys;
  Demands demands;
};

const std::array<CommandRow, 16>& commands() {
  constexpr Demands kNone{}, kControl{.control = true}, kTargets{.control = true, .running = true};
  static const std::array<CommandRow, 16> table{{
      {Command::kStatus, "status", {}, kNone},
      {Command::kSubscribe, "subscribe", {"rate"}, kNone},
      {Command::kGeometry, "geometry", {}, kNone},
      {Command::kSurface, "surface", {"rate"}, kNone},
      {Command::kAcquire, "acquire", {"steal"}, kNone},
      {Command::kRelease, "release", {}, kNone},
      {Command::kTarget, "target", {"position", "velocity", "in", "speed"}, kTargets},
      {Command::kPlay, "play", {}, kTargets},
      {Command::kPause, "pause", {}, kTargets},
      {Command::kResume, "resume", {}, kTargets},
      {Command::kHold, "hold", {}, kTargets},
      {Command::kSet, "set", {"path_rate"}, kTargets},
      {Command::kDisable, "disable", {}, kNone},
      {Command::kEnable, "enable", {}, kControl},
      {Command::kReset, "reset", {}, kControl},
      {Command::kStop, "stop", {}, kNone},
  }};
  return table;
}

[[noreturn]] void refuse(const std::string& message) { throw RequestError("bad_request", message); }

/// A line as JSON; discarded where it is none, or so deeply nested that copying it, which recurses, could
/// exhaust the stack.
json parse(std::string_view line) {
  constexpr int kDeepest = 32;
  bool too_deep = false;
  const json::parser_callback_t keep = [&](int depth, json::parse_event_t event, json&) {
    const bool opens =
        event == json::parse_event_t::object_start || event == json::parse_event_t::array_start;
    too_deep = too_deep || (opens && depth >= kDeepest);
    return !too_deep;
  };
  const json value = json::parse(line, keep, false);
  return too_deep ? json(json::value_t::discarded) : value;
}

const CommandRow& row_of(const json& request) {
  const auto found = request.find("command");
  if (found == request.end() || !found->is_string()) refuse("say which \"command\", a text");
  const auto& table = commands();
  const auto row =
      std::find_if(table.begin(), table.end(), [&](const CommandRow& r) { return *found == r.name; });
  if (row == table.end()) {
    std::vector<std::string> names;
    for (const CommandRow& known : table) names.push_back(known.name);
    throw RequestError("unknown_command", fmt::format("there is no command {}; there are: {}", found->dump(),
                                                      fmt::join(names, ", ")));
  }
  return *row;
}

void check_keys(const json& request, const CommandRow& row) {
  for (const auto& [key, value] : request.items()) {
    if (key == "id" || key == "version" || key == "command") continue;
    if (std::find(row.keys.begin(), row.keys.end(), key) == row.keys.end())
      refuse(row.keys.empty()
                 ? fmt::format("{} takes nothing more, not \"{}\"", row.name, key)
                 : fmt::format("{} has no \"{}\"; it has: {}", row.name, key, fmt::join(row.keys, ", ")));
  }
}

/// A number within limits, where the key is there.
std::optional<double> number(const json& request, const char* key, double least, double greatest) {
  const auto found = request.find(key);
  if (found == request.end()) return std::nullopt;
  const double value = found->is_number() ? found->get<double>() : NAN;
  if (!(value >= least && value <= greatest))
    refuse(fmt::format("\"{}\" is a number from {:g} to {:g}, not {}", key, least, greatest, found->dump()));
  return value;
}

/// One value a coordinate, where it is named.
std::vector<std::optional<double>> by_coordinate(const json& request, const char* key,
                                                 const std::vector<std::string>& coordinates) {
  std::vector<std::optional<double>> values(coordinates.size());
  const auto found = request.find(key);
  if (found == request.end()) return values;
  if (!found->is_object() || found->empty())
    refuse(fmt::format("\"{}\" is an object of coordinates, such as {{\"{}\": 0.01}}", key,
                       coordinates.front()));
  for (const auto& [name, value] : found->items()) {
    const auto place = std::find(coordinates.begin(), coordinates.end(), name);
    if (place == coordinates.end())
      refuse(fmt::format("there is no coordinate \"{}\"; there are: {}", name, fmt::join(coordinates, ", ")));
    if (!value.is_number() || !std::isfinite(value.get<double>()))
      refuse(fmt::format("\"{}\" of \"{}\" is a finite number, not {}", name, key, value.dump()));
    values[static_cast<std::size_t>(place - coordinates.begin())] = value.get<double>();
  }
  return values;
}

void check_workspace(const ControlRequest& request, const Config& config,
                     const std::vector<std::string>& coordinates) {
  const auto rows = effector_rows(config);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (!request.position[r] || !rows[r].is_position()) continue;
    const double least = config.control.workspace_min[rows[r].axis],
                 most = config.control.workspace_max[rows[r].axis];
    if (*request.position[r] < least || *request.position[r] > most)
      throw RequestError("outside_workspace",
                         fmt::format("{} = {:g} m is outside control.workspace, which is from {:g} to {:g} m",
                                     coordinates[r], *request.position[r], least, most));
  }
}

void read_target(const json& object, ControlRequest& request, const Config& config,
                 const std::vector<std::string>& coordinates) {
  request.position = by_coordinate(object, "position", coordinates);
  if (!object.contains("position")) refuse("target needs \"position\"");
  check_workspace(request, config, coordinates);
  request.in_s = number(object, "in", 0, kLongestWay_s);
  request.speed = number(object, "speed", 1e-6, kTopSpeed);
  if (request.in_s && request.speed) refuse("give \"in\" or \"speed\", not both");
  if (object.contains("velocity") && !request.in_s)
    refuse("\"velocity\" goes with \"in\": it begins when that time is over");
  const auto velocity = by_coordinate(object, "velocity", coordinates);
  request.velocity.setZero(static_cast<Eigen::Index>(coordinates.size()));
  for (std::size_t r = 0; r < velocity.size(); ++r)
    request.velocity[static_cast<Eigen::Index>(r)] = velocity[r].value_or(0);
}

ControlRequest read_object(const json& object, const Config& config,
                           const std::vector<std::string>& coordinates) {
  const json version = object.value("version", json(kControlProtocol));
  if (version != kControlProtocol)
    throw RequestError("version", fmt::format("this daemon speaks version {} of the control protocol, not {}",
                                              kControlProtocol, version.dump()));
  const CommandRow& row = row_of(object);
  check_keys(object, row);
  ControlRequest request;
  request.id = object.value("id", json());
  request.command = row.command;
  if (row.command == Command::kTarget) read_target(object, request, config, coordinates);
  if (row.command == Command::kSubscribe || row.command == Command::kSurface) {
    const bool states = row.command == Command::kSubscribe;
    const auto rate = number(object, "rate", 0, states ? kTopStateRate_hz : kTopSurfaceRate_hz);
    if (!rate) refuse(fmt::format("{} needs \"rate\", in Hz; 0 ends it", row.name));
    request.rate_hz = *rate;
  }
  if (row.command == Command::kSet) {
    request.path_rate = number(object, "path_rate", 0, 1);
    if (!request.path_rate) refuse("set needs \"path_rate\", from 0 to 1");
  }
  if (const auto steal = object.find("steal"); steal != object.end()) {
    if (!steal->is_boolean()) refuse("\"steal\" is true or false");
    request.steal = steal->get<bool>();
  }
  if (request.command == Command::kPlay && !config.motion)
    throw RequestError("no_path", "the robot file has no path: it has no section motion");
  return request;
}

}  // namespace

ControlRequest read_request(std::string_view line, const Config& config,
                            const std::vector<std::string>& coordinates) {
  const json object = parse(line);
  if (!object.is_object())
    throw RequestError(
        "bad_json", "a line is one JSON object, at most 32 levels deep, such as {\"command\": \"status\"}");
  try {
    return read_object(object, config, coordinates);
  } catch (RequestError& error) {
    error.id = object.value("id", json());
    throw;
  }
}

Demands demands_of(Command command) {
  const auto& table = commands();
  return std::find_if(table.begin(), table.end(), [&](const CommandRow& r) { return r.command == command; })
      ->demands;
}

}  // namespace tendril::app
