// SPDX-License-Identifier: Apache-2.0
#include "tests/app/config/mistake.h"

#include <algorithm>
#include <catch2/catch.hpp>

#include "app/config/config.h"
#include "app/config/load_config.h"
#include "tests/app/robot_file.h"

namespace tendril::app {

const std::string kGood = R"(# a comment before everything
robot: twin
mesh:
  file: body.msh
  rotate: 90 deg about x
material:
  young_modulus: 150 kPa
  poisson_ratio: 0.45

  mass: 0.5 kg
gravity: 0 0 -9.81 m/s^2
fixed: {box: [-15 -15 -40 mm, 15 15 10 mm]}
effectors:
  - name: tip
    point: 0 0 125 mm
    coordinates: xyz
actuators:
  - name: north
    cable: [body 0 97 45 mm, guide 0 10 30 mm]
    tension: 0 8 N
    stroke: -25 35 mm
    top_speed: 100 mm/s
    drive: {node: 1, counts_per_turn: 65536, pulley_radius: 10 mm}
  - name: south
    cable: [body 0 -97 45 mm, guide 0 -10 30 mm]
    tension: 0 7 N
    stroke: -24 34 mm
    top_speed: 110 mm/s
    drive: {node: 2, counts_per_turn: 65537, pulley_radius: 11 mm, reversed: false}
control:
  rate: 600 Hz
  priority: 80
  stop: hold
  workspace: [-40 -40 90 mm, 40 40 150 mm]
bus:
  name: vcan0
  bitrate: 1 Mbit/s
  master_node: 127
  heartbeat: 50 ms
  heartbeat_timeout: 150 ms
motion:
  origin: 0 0 125 mm
  waypoints:
    - 10 10 25 mm
    - -10 10 0 mm
  speed: 25 mm/s
plant:
  young_modulus: 165 kPa
  poisson_ratio: 0.44
  mass: 0.51 kg
)";

namespace {

void check(const Mistake& mistake, const std::string& base) {
  INFO("'" << mistake.good << "' becomes '" << mistake.bad << "'");
  const std::size_t place = base.find(mistake.good);
  REQUIRE(place != std::string::npos);
  const std::string text = std::string(base).replace(place, mistake.good.size(), mistake.bad);
  const std::size_t at = text.find(mistake.at ? mistake.at : mistake.bad);
  REQUIRE(at != std::string::npos);
  const RobotFile file(text);
  const std::string message = error_of(file.path());
  const auto line = 1 + std::count(text.begin(), text.begin() + std::ptrdiff_t(at), '\n');
  CHECK_THAT(message, Catch::StartsWith(file.path().string() + ":" + std::to_string(line) + ": "));
  for (const std::string& fragment : mistake.fragments) CHECK_THAT(message, Catch::Contains(fragment));
}

}  // namespace

void check_mistakes(const std::vector<Mistake>& mistakes, const std::string& base) {
  for (const Mistake& mistake : mistakes) check(mistake, base);
}

std::string error_of(const std::filesystem::path& file) {
  try {
    load_config(file);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace tendril::app
