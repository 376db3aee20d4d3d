// SPDX-License-Identifier: Apache-2.0
#include "app/operation/control_request.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "app/operation/coordinates.h"

namespace tendril::app::control_request_test {

/// A tip that moves in x and z, and the volume of a chamber.
Config robot() {
  Config config;
  config.effectors = {{"tip", {}, {true, false, true}, {}, {1, 1}}, {"chamber", {}, {}, RegionConfig{}, {1}}};
  config.control.workspace_min = {-0.05, -0.05, 0.05};
  config.control.workspace_max = {0.05, 0.05, 0.15};
  return config;
}

const Config kConfig = robot();
const std::vector<std::string> kCoordinates = coordinate_names(kConfig);

ControlRequest read(std::string_view line) { return read_request(line, kConfig, kCoordinates); }

std::string code_of(std::string_view line) {
  try {
    read(line);
  } catch (const RequestError& error) {
    CHECK(std::string(error.what()).size() > 10);
    return error.code();
  }
  return "";
}

TEST_CASE("Coordinates are named after their effector, those that are not controlled have no name",
          "[unit]") {
  CHECK(kCoordinates == std::vector<std::string>{"tip.x", "tip.z", "chamber.volume"});
}

TEST_CASE("A target's position, time and velocity are read by coordinate", "[unit]") {
  const ControlRequest request = read(
      R"({"id": "a", "version": 1, "command": "target", "position": {"tip.z": 0.1, "chamber.volume": 1e-6},
          "in": 0.02, "velocity": {"tip.z": -0.01}})");
  CHECK(request.id == "a");
  CHECK(request.command == Command::kTarget);
  CHECK(request.position == std::vector<std::optional<double>>{std::nullopt, 0.1, 1e-6});
  CHECK(request.in_s == 0.02);
  CHECK(request.velocity[1] == -0.01);
  CHECK(request.velocity[0] == 0);
  CHECK_FALSE(request.speed);
}

TEST_CASE("A request that is not possible is refused with a code and a sentence", "[unit]") {
  const auto [code, line] = GENERATE(table<std::string, std::string>({
      {"bad_json", ""},
      {"bad_json", "status"},
      {"bad_json", "[1, 2]"},
      {"bad_json", R"({"command": "status")"},
      {"bad_json", "{\"command\": \"status\", \"id\": \"\xff\"}"},
      {"version", R"({"version": 2, "command": "status"})"},
      {"version", R"({"version": "1", "command": "status"})"},
      {"bad_request", R"({"id": 1})"},
      {"bad_request", R"({"command": 7})"},
      {"unknown_command", R"({"command": "dance"})"},
      {"bad_request", R"({"command": "status", "rate": 1})"},
      {"bad_request", R"({"command": "subscribe"})"},
      {"bad_request", R"({"command": "subscribe", "rate": -1})"},
      {"bad_request", R"({"command": "subscribe", "rate": 1001})"},
      {"bad_request", R"({"command": "subscribe", "rate": "10"})"},
      {"bad_request", R"({"command": "surface"})"},
      {"bad_request", R"({"command": "surface", "rate": 31})"},
      {"bad_request", R"({"command": "geometry", "rate": 1})"},
      {"bad_request", R"({"command": "acquire", "steal": 1})"},
      {"bad_request", R"({"command": "target"})"},
      {"bad_request", R"({"command": "target", "position": {}})"},
      {"bad_request", R"({"command": "target", "position": [0, 0]})"},
      {"bad_request", R"({"command": "target", "position": {"tip.y": 0}})"},
      {"bad_request", R"({"command": "target", "position": {"x": 0}})"},
      {"bad_request", R"({"command": "target", "position": {"tip.x": null}})"},
      {"bad_request", R"({"command": "target", "position": {"tip.x": "0"}})"},
      {"outside_workspace", R"({"command": "target", "position": {"tip.x": 0.0501}})"},
      {"outside_workspace", R"({"command": "target", "position": {"tip.x": -1e300}})"},
      {"bad_request", R"({"command": "target", "position": {"tip.x": 0}, "in": -1})"},
      {"bad_request", R"({"command": "target", "position": {"tip.x": 0}, "speed": 0})"},
      {"bad_request", R"({"command": "target", "position": {"tip.x": 0}, "speed": 0.1, "in": 1})"},
      {"bad_request", R"({"command": "target", "position": {"tip.x": 0}, "velocity": {"tip.x": 1}})"},
      {"bad_request", R"({"command": "set"})"},
      {"bad_request", R"({"command": "set", "path_rate": 1.01})"},
      {"no_path", R"({"command": "play"})"},
  }));
  CAPTURE(line);
  CHECK(code_of(line) == code);
}

TEST_CASE("A number that JSON can write and a double cannot hold is refused", "[unit]") {
  CHECK(code_of(R"({"command": "target", "position": {"tip.x": 1e999}})") != "");
  CHECK(code_of(R"({"command": "target", "position": {"tip.x": NaN}})") == "bad_json");
}

TEST_CASE("Only commands that can move the robot need the control, and those about targets a run", "[unit]") {
  for (const Command command : {Command::kStatus, Command::kSubscribe, Command::kGeometry, Command::kSurface,
                                Command::kAcquire, Command::kRelease, Command::kDisable, Command::kStop})
    CHECK_FALSE(demands_of(command).control);
  for (const Command command :
       {Command::kTarget, Command::kPlay, Command::kPause, Command::kResume, Command::kHold, Command::kSet}) {
    CHECK(demands_of(command).control);
    CHECK(demands_of(command).running);
  }
  for (const Command command : {Command::kEnable, Command::kReset}) {
    CHECK(demands_of(command).control);
    CHECK_FALSE(demands_of(command).running);
  }
}

TEST_CASE("Any line is read, or refused with a code", "[law]") {
  const auto seed = std::random_device{}();
  INFO("seed " << seed);
  std::mt19937 random(seed);
  const std::string seeds[] = {
      R"({"id": 1, "version": 1, "command": "target", "position": {"tip.z": 0.1}, "in": 0.02, "velocity": {"tip.x": 1}})",
      R"({"command": "subscribe", "rate": 50})", R"({"command": "acquire", "steal": true})",
      R"({"command": "set", "path_rate": 0.5})"};
  const std::string signs = "{}[]\",:0123456789.eE+-ntf\\ \x80\xff";
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  int taken = 0;
  for (int k = 0; k < 20'000; ++k) {
    std::string line = seeds[below(std::size(seeds))];
    for (std::size_t changes = below(4); changes-- > 0;) {
      const std::size_t at = below(line.size());
      if (below(3) == 0)
        line.erase(at, 1 + below(4));
      else
        line.insert(at, 1, signs[below(signs.size())]);
      if (line.empty()) line = " ";
    }
    CAPTURE(line);
    const std::string code = code_of(line);
    if (code.empty()) {
      ++taken;
      const ControlRequest request = read(line);
      for (const auto& value : request.position) REQUIRE((!value || std::isfinite(*value)));
    }
  }
  CHECK(taken > 1000);
}

TEST_CASE("A line may be nested, but not so deeply that reading it exhausts the stack", "[unit]") {
  const auto nested = [](std::size_t depth) {
    return R"({"command": "status", "id": )" + std::string(depth, '[') + std::string(depth, ']') + "}";
  };
  CHECK(code_of(nested(31)) == "");
  CHECK(code_of(nested(32)) == "bad_json");
  CHECK(code_of(nested(30'000)) == "bad_json");
  CHECK(code_of(std::string(60'000, '[')) == "bad_json");
  CHECK(code_of(R"({"command": "status", "id": "[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[["})") == "");
}

TEST_CASE("Brackets in a text hide no depth", "[unit]") {
  const auto nested = [](std::size_t depth) {
    return R"({"command": "status", "id": ["]]]]]]]]", )" + std::string(depth, '[') +
           std::string(depth, ']') + "]}";
  };
  CHECK(code_of(nested(30)) == "");
  CHECK(code_of(nested(31)) == "bad_json");
}

}  // namespace tendril::app::control_request_test
