// SPDX-License-Identifier: Apache-2.0
#include "app/client/operate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

#include "app/client/control_client.h"
#include "app/client/find_socket.h"
#include "app/client/shape_trajectory.h"
#include "app/client/trajectory.h"
#include "app/config/utf8.h"
#include "app/program/exit_codes.h"
#include "app/program/stop_signal.h"

namespace tendril::app {
namespace {

using nlohmann::ordered_json;

/// Millimetres for a position, millilitres for a volume.
std::string people_read(const std::string& coordinate, const ordered_json& value) {
  if (value.is_null()) return "-";
  const bool volume = coordinate.ends_with(".volume");
  return fmt::format("{:.2f} {}", (volume ? 1e6 : 1e3) * value.get<double>(), volume ? "ml" : "mm");
}

/// What has stopped the robot and what to do about it, and what is wrong besides; a line each.
std::string faults_of(const ordered_json& state) {
  std::string text;
  if (const ordered_json& fault = state.at("fault"); !fault.is_null())
    text += fmt::format("stopped {:.0f} s ago: {}\n  {}\n  Then: tendrilctl reset\n",
                        state.at("time").get<double>() - fault.at("since").get<double>(),
                        fault.at("what").get<std::string>(), fault.at("do").get<std::string>());
  else
    for (const auto& present : state.at("faults"))
      text += fmt::format("fault: {}\n", present.get<std::string>());
  return text;
}

std::string screen_of(const std::string& robot, const ordered_json& state) {
  const auto control = state.at("control").is_null() ? "nobody" : state.at("control").get<std::string>();
  std::string text =
      fmt::format("{}  phase {}  mode {}  control: {}\n", robot, state.at("phase").get<std::string>(),
                  state.at("mode").get<std::string>(), control);
  text += fmt::format("{:20} {:>12} {:>12} {:>12}\n", "", "target", "model", "measured");
  if (state.at("target").is_object())
    for (const auto& [name, target] : state.at("target").items()) {
      const ordered_json measured = state.at("measured").value(name, ordered_json());
      text += fmt::format("{:20} {:>12} {:>12} {:>12}\n", name, people_read(name, target),
                          people_read(name, state.at("model").at(name)),
                          people_read(name, measured.is_null() ? measured : measured.at("value")));
    }
  text += fmt::format("{:20} {:>12} {:>12} {:>12} {:>8}   (SI units)\n", "", "command", "measured", "effort",
                      "power");
  for (const auto& [name, actuator] : state.at("actuators").items())
    text += fmt::format("{:20} {:>12.5g} {:>12.5g} {:>12.5g} {:>8}\n", name,
                        actuator.at("command").get<double>(), actuator.at("displacement").get<double>(),
                        actuator.at("effort").get<double>(), actuator.at("power").get<std::string>());
  text += fmt::format(
      "QP {} in {} iterations, snapshot {:.1f} ms old, {} of {} cycles late\n",
      state.at("qp").at("status").is_null() ? "-" : state.at("qp").at("status").get<std::string>(),
      state.at("qp").at("iterations").get<int>(), 1e3 * state.at("snapshot_age").get<double>(),
      state.at("late_cycles").get<int64_t>(), state.at("cycles").get<int64_t>());
  return text + faults_of(state);
}

void print_state(const ControlClient& client, const OperateOptions& options, const ordered_json& state) {
  if (options.json)
    fmt::print("{}\n", to_text(state));
  else
    fmt::print("{}", screen_of(client.greeting().at("robot").get<std::string>(), state));
  std::fflush(stdout);
}

/// States as they come, until a stop signal.
int watch(ControlClient& client, const OperateOptions& options) {
  client.ask({{"command", "subscribe"}, {"rate", options.rate_hz}});
  const bool screen = !options.json && ::isatty(STDOUT_FILENO);
  while (!stop_signalled()) {
    const ordered_json message = client.next();
    if (!message.contains("state")) continue;
    if (screen) fmt::print("\033[H\033[2J");
    print_state(client, options, message.at("state"));
  }
  return kOk;
}

/// Waits until the drives are as they are wanted.
/// @return  whether they are; false where a fault or a stop signal came first
bool wait_for_drives(ControlClient& client, bool enabled) {
  client.ask({{"command", "subscribe"}, {"rate", 20}});
  // The state before the request may still be on its way.
  const double asked_s = client.ask({{"command", "status"}}).at("state").at("time").get<double>();
  while (!stop_signalled()) {
    const ordered_json message = client.next();
    if (!message.contains("state")) continue;
    const ordered_json& state = message.at("state");
    if (state.at("time").get<double>() <= asked_s) continue;
    bool off = state.at("phase") == "standby";
    for (const auto& actuator : state.at("actuators")) off = off && actuator.at("power") != "on";
    if (enabled ? state.at("phase") == "run" : off) return true;
    if (enabled && !state.at("fault").is_null()) {
      fmt::print(stderr, "{}", faults_of(state));
      return false;
    }
  }
  return false;
}

/// Waits until the target that is served is at the goal.
/// @return  the state then; nothing where a stop signal came first, after which the robot holds
std::optional<ordered_json> follow(ControlClient& client, const ordered_json& goal) {
  client.ask({{"command", "subscribe"}, {"rate", 10}});
  while (!stop_signalled()) {
    const ordered_json message = client.next();
    if (message.value("event", "") == "control_lost")
      throw RequestRefused("another client has taken the control");
    if (!message.contains("state")) continue;
    const ordered_json& state = message.at("state");
    if (state.at("phase") != "run") throw RequestRefused("the robot stops");
    double left = 0;
    for (const auto& [name, value] : goal.items())
      left = std::max(left, std::abs(state.at("target").at(name).get<double>() - value.get<double>()));
    if (left > 1e-7) continue;
    client.ask({{"command", "subscribe"}, {"rate", 0}});
    return state;
  }
  client.ask({{"command", "hold"}});
  return std::nullopt;
}

void go_to(ControlClient& client, const OperateOptions& options) {
  const auto names = client.greeting().at("coordinates").get<std::vector<std::string>>();
  const std::string effector = names.front().substr(0, names.front().rfind('.') + 1);
  std::vector<std::string> of_first;
  for (const std::string& name : names)
    if (name.starts_with(effector)) of_first.push_back(name);
  if (options.position_mm.size() != of_first.size())
    throw RequestRefused(
        fmt::format("target needs {} values in mm: {}", of_first.size(), fmt::join(of_first, " ")));
  ordered_json goal;
  for (std::size_t k = 0; k < of_first.size(); ++k) goal[of_first[k]] = 1e-3 * options.position_mm[k];
  ordered_json request{{"command", "target"}, {"position", goal}};
  if (options.speed_mm_s) request["speed"] = 1e-3 * *options.speed_mm_s;
  if (options.in_s) request["in"] = *options.in_s;
  client.ask(request);
  if (const auto state = follow(client, goal)) print_state(client, options, *state);
}

ordered_json position_of(const Trajectory& trajectory, double t_s) {
  const std::vector<double> point = trajectory.at(t_s);
  ordered_json position;
  for (std::size_t k = 0; k < point.size(); ++k) position[trajectory.names()[k]] = point[k];
  return position;
}

void show_progress(double t_s, double duration_s) {
  constexpr int kWidth = 40;
  const int done = duration_s > 0 ? static_cast<int>(kWidth * t_s / duration_s) : kWidth;
  fmt::print("\r[{:{}}] {:.1f} of {:.1f} s", std::string(static_cast<std::size_t>(done), '='), kWidth, t_s,
             duration_s);
  std::fflush(stdout);
}

/// The shape that is asked for, around the present target where nothing else is said.
Trajectory shape_of(ControlClient& client, const OperateOptions& options) {
  const auto coordinates = client.greeting().at("coordinates").get<std::vector<std::string>>();
  const std::string effector = coordinates.front().substr(0, coordinates.front().rfind('.'));
  const auto meaning = [](const auto& words, const std::string& word) {
    return std::ranges::find(words, word, [](const auto& entry) { return entry.first; })->second;
  };
  ShapeRequest request;
  request.shape = meaning(kShapes, options.shape);
  request.layout.plane = meaning(kPlanes, options.plane);
  if (options.size_mm.empty() || options.size_mm.size() > 2)
    throw RequestRefused("--shape needs --size: its width and height in mm, or one value for both");
  request.layout.size = {1e-3 * options.size_mm.front(), 1e-3 * options.size_mm.back()};
  for (const double side : request.layout.size)
    if (side < 0 ||
        (side == 0 && (request.shape != Shape::kLine || options.size_mm.front() == options.size_mm.back())))
      throw RequestRefused("--size is above 0; only one side of a line may be 0");
  if (options.speed_mm_s) request.speed = 1e-3 * *options.speed_mm_s;
  request.turns = options.turns;
  const auto names = coordinates_of(request.layout, effector, coordinates);
  if (!options.centre_mm.empty() && options.centre_mm.size() != 2)
    throw RequestRefused(fmt::format("--centre needs 2 values in mm: {} {}", names[0], names[1]));
  const ordered_json state = client.ask({{"command", "status"}}).at("state");
  for (std::size_t k = 0; k < 2; ++k) {
    if (options.centre_mm.empty() && !state.at("target").is_object())
      throw RequestRefused("the robot has no target yet: say where with --centre");
    request.centre[k] = options.centre_mm.empty() ? state.at("target").at(names[k]).get<double>()
                                                  : 1e-3 * options.centre_mm[k];
  }
  return shape_trajectory(request, effector, coordinates);
}

/// Goes to the beginning of a trajectory, then streams it: each target is to be reached two periods after it
/// is sent, so that one that is late is bridged.
void play(ControlClient& client, const OperateOptions& options) {
  constexpr double kPeriod_s = 0.01;
  const Trajectory trajectory =
      options.shape.empty() ? Trajectory(options.trajectory,
                                         client.greeting().at("coordinates").get<std::vector<std::string>>())
                            : shape_of(client, options);
  const ordered_json start = position_of(trajectory, 0);
  const bool closed = trajectory.at(trajectory.duration_s()) == trajectory.at(0);
  const bool terminal = !options.json && ::isatty(STDOUT_FILENO);
  const double rate = options.percent / 100;
  for (bool first = true; (first || options.loop) && !stop_signalled(); first = false) {
    if (first || !closed) {
      client.ask({{"command", "target"}, {"position", start}});
      if (!follow(client, start)) return;
    }
    const auto begin = std::chrono::steady_clock::now();
    for (double t_s = 0; t_s < trajectory.duration_s() && !stop_signalled();) {
      std::this_thread::sleep_for(std::chrono::duration<double>(kPeriod_s));
      t_s = rate * std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      client.ask({{"command", "target"},
                  {"position", position_of(trajectory, t_s + 2 * rate * kPeriod_s)},
                  {"in", 2 * kPeriod_s}});
      if (terminal) show_progress(std::min(t_s, trajectory.duration_s()), trajectory.duration_s());
    }
  }
  if (stop_signalled()) client.ask({{"command", "hold"}});
  if (terminal) fmt::print("\n");
}

}  // namespace

int operate(const OperateOptions& options) {
  ControlClient client(find_socket(options.socket));
  try {
    if (options.command == "status" && !options.watch) {
      print_state(client, options, client.ask({{"command", "status"}}).at("state"));
      return kOk;
    }
    if (options.command == "faults") {
      const ordered_json state = client.ask({{"command", "status"}}).at("state");
      const std::string faults = faults_of(state);
      fmt::print("{}", faults.empty() ? "no fault\n" : faults);
      return faults.empty() ? kOk : kCheckFailed;
    }
    if (options.command == "status" || options.command == "monitor") return watch(client, options);
    if (options.command == "stop" || options.command == "disable") {  // these need no control
      client.ask({{"command", options.command}});
      return options.command == "stop" || wait_for_drives(client, false) ? kOk : kCheckFailed;
    }
    client.ask({{"command", "acquire"}, {"steal", options.steal}});
    if (options.command == "target")
      go_to(client, options);
    else if (options.command == "play" && !(options.trajectory.empty() && options.shape.empty()))
      play(client, options);
    else if (options.command == "speed")
      client.ask({{"command", "set"}, {"path_rate", options.percent / 100}});
    else
      client.ask({{"command", options.command}});
    if (options.command == "reset" || options.command == "enable")
      if (!wait_for_drives(client, true)) return kCheckFailed;
    client.ask({{"command", "release"}});
    return kOk;
  } catch (const RequestRefused& refusal) {
    fmt::print(stderr, "tendrilctl: {}\n", refusal.what());
    return kCheckFailed;
  }
}

}  // namespace tendril::app
