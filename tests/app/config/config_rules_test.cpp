// SPDX-License-Identifier: Apache-2.0
#include "app/config/config_rules.h"

#include <catch2/catch.hpp>
#include <numbers>

#include "app/config/load_config.h"
#include "app/config/master_config.h"
#include "hal/drive/drive_protocol.h"
#include "hal/odrive/odrive_protocol.h"
#include "hal/odrive/odrive_settings.h"
#include "tests/app/config/mistake.h"
#include "tests/app/robot_file.h"
#include "tests/replace_each.h"

namespace tendril::app::config_rules_test {

TEST_CASE("What one key demands of another is checked", "[unit]") {
  check_mistakes({
      {"node: 2,",
       "node: 1,",
       "node: 1, counts_per_turn: 65537",
       {"actuators[1].drive.node: found '1'", "the drive of 'north' has this one"}},
      {"node: 2,",
       "node: 127,",
       nullptr,
       {"actuators[1].drive.node: found '127'", "the controller (bus.master_node) has this one"}},
      {"name: south",
       "name: north",
       "name: north\n    cable: [body 0 -97",
       {"actuators[1].name", "actuators[0] has this one"}},
      {"name: south",
       "name: tip",
       "name: tip\n    cable",
       {"actuators[1].name: found 'tip'", "effectors[0] has this one"}},
      {"heartbeat_timeout: 150 ms",
       "heartbeat_timeout: 99.9 ms",
       nullptr,
       {"bus.heartbeat_timeout: found '99.9 ms', expected at least two heartbeats, 0.1 s"}},
      {"  heartbeat: 50 ms\n  heartbeat_timeout: 150 ms",
       "  heartbeat: 80 ms",
       "bus:",
       {"bus.heartbeat_timeout: found nothing, expected at least two heartbeats, 0.16 s (it is 0.15 s)"}},
      {"  master_node: 127",
       "  master_node: 127\n  feedback_timeout: 3 ms",
       "3 ms",
       {"bus.feedback_timeout: found '3 ms', expected at least two positions' time, 0.00333333 s"}},
      {"[body 0 97 45 mm, guide 0 10 30 mm]",
       "[body 0 97 45 mm]",
       nullptr,
       {"actuators[0].cable", "at least two points"}},
      {"[body 0 97 45 mm, guide 0 10 30 mm]",
       "[guide 0 10 30 mm, body 0 97 45 mm]",
       nullptr,
       {"actuators[0].cable[0]: found 'guide 0 10 30 mm', expected the attachment first"}},
      {"[body 0 97 45 mm, guide 0 10 30 mm]",
       "[body 0 97 45 mm, guide 0 9.7 4.5 cm]",
       nullptr,
       {"actuators[0].cable[1]", "a point apart from the one before it"}},
      {"  speed: 25 mm/s",
       "  speed: 2e-6 mm/s",
       nullptr,
       {"motion.speed: found '2e-6 mm/s'", "at least ", " days, and 30 are allowed"}},
      {"- -10 10 0 mm",
       "- -10 10 26 mm",
       nullptr,
       {"motion.waypoints[1]: found '-10 10 26 mm'", "control.workspace", "at -0.01 0.01 0.151 m"}},
      {"- -10 10 0 mm", "- -40.1 10 0 mm", nullptr, {"motion.waypoints[1]"}},
      {"point: 0 0 125 mm\n    coordinates: xyz",
       "cavity: chamber",
       nullptr,
       {"effectors[0].cavity: found 'chamber'", "a point or points first", "report"}},
      {"coordinates: xyz",
       "coordinates: xyz\n    weight: [0, 0, 0]",
       "effectors:",
       {"effectors: found a list of 1", "a coordinate with a weight above 0"}},
      {"  mass: 0.5 kg",
       "  mass: 0.5 kg\n  regions:\n    - {where: a, young_modulus: 1 MPa, poisson_ratio: 0, mass: 300 g}\n"
       "    - {where: b, young_modulus: 1 MPa, poisson_ratio: 0, mass: 201 g}",
       "201 g",
       {"material.regions[1].mass: found '201 g'", "no heavier than the whole", "0.501 kg of 0.5 kg"}},
  });
}

const std::string kRodDrive = "drive: {node: 1, counts_per_turn: 65536, lead: 2 mm}";

/// What is said of a rod with these ends in the place of the first cable.
std::string error_of_rod(const std::string& ends) {
  std::string yaml = kGood;
  const auto replace = [&](const std::string& from, const std::string& to) {
    yaml.replace(yaml.find(from), from.size(), to);
  };
  replace("cable: [body 0 97 45 mm, guide 0 10 30 mm]", "rod: " + ends);
  replace("tension: 0 8 N", "force: -8 8 N");
  replace("drive: {node: 1, counts_per_turn: 65536, pulley_radius: 10 mm}", kRodDrive);
  return error_of(RobotFile(yaml).path());
}

TEST_CASE("A rod has two ends apart, one of them on the body, either way round", "[unit]") {
  CHECK(error_of_rod("[guide 0 0 0 mm, body 0 97 45 mm]") == "no error");
  CHECK(error_of_rod("[body 0 97 45 mm, guide 0 0 0 mm]") == "no error");
  CHECK(error_of_rod("[body 0 97 45 mm, body 0 -97 45 mm]") == "no error");
  CHECK_THAT(error_of_rod("[guide 0 0 0 mm, guide 0 97 45 mm]"),
             Catch::Contains(":19: actuators[0].rod: found a list of 2, expected an end on the body"));
  CHECK_THAT(error_of_rod("[guide 0 97 45 mm, body 0 9.7 4.5 cm]"),
             Catch::Contains(":19: actuators[0].rod[1]") && Catch::Contains("apart from the other end"));
  CHECK_THAT(error_of_rod("[body 0 97 45 mm]"), Catch::Contains("actuators[0].rod: found a list of 1"));
}

TEST_CASE("An effector that is not controlled cannot be the one that moves", "[unit]") {
  std::string base = kGood;
  base.insert(base.find("actuators:"), "  - {name: idle, point: 0 0 120 mm, weight: 0}\n");
  check_mistakes({{"  speed: 25 mm/s",
                   "  speed: 25 mm/s\n  effector: idle",
                   "effector: idle",
                   {"motion.effector: found 'idle', expected an effector with a weight above 0"}}},
                 base);
}

TEST_CASE("A waypoint on the border of the workspace lies in it, whatever binary makes of the sum",
          "[unit]") {
  REQUIRE(0.1 + 0.2 > 0.3);
  const std::size_t motion = kGood.find("motion:");
  std::string yaml =
      kGood.substr(0, motion) + "motion: {origin: 0 0 100 mm, waypoints: [0 0 200 mm], speed: 1 mm/s}\n";
  yaml.replace(yaml.find("40 40 150 mm"), 12, "40 40 300 mm");
  CHECK(error_of(RobotFile(yaml).path()) == "no error");
}

TEST_CASE("What a drive is told of its reference must make sense", "[unit]") {
  const auto drive = [](const std::string& more) { return "node: 1, " + more + ","; };
  check_mistakes(
      {{"node: 1,",
        drive("reference: maybe"),
        nullptr,
        {"actuators[0].drive.reference: found 'maybe', expected absolute or homing"}},
       {"node: 1,",
        drive("mapping: found"),
        nullptr,
        {"actuators[0].drive.mapping: found 'found', expected configure or as_found"}},
       {"node: 1,",
        drive("homing: {method: 17}"),
        nullptr,
        {"actuators[0].drive.reference: found nothing, expected homing, as there is a section"}},
       {"node: 1,",
        drive("reference: homing, homing: {method: 37}"),
        nullptr,
        {"actuators[0].drive.referenced_bit: found nothing, expected the statusword bit",
         "homing method 37 takes wherever"}},
       {"node: 1,",
        drive("referenced_bit: 9"),
        nullptr,
        {"actuators[0].drive.referenced_bit: found '9', expected 8, 14 or 15"}},
       {"node: 1,",
        drive("reference: homing, homing: {method: 128}"),
        nullptr,
        {"actuators[0].drive.homing.method: found '128', expected a whole number from -128 to 127"}},
       {"node: 1,",
        drive("reference: homing, homing: {speed_search: 0}"),
        nullptr,
        {"actuators[0].drive.homing.speed_search: found '0', expected a whole number no less than 1"}}});
}

TEST_CASE("A drive that follows efforts must know its torques, and no other may", "[unit]") {
  const auto drive = [](const std::string& more) { return "node: 1, " + more + ","; };
  check_mistakes(
      {{"node: 1,",
        drive("setpoint: force"),
        nullptr,
        {"actuators[0].drive.setpoint: found 'force', expected displacement or effort"}},
       {"node: 1,",
        drive("setpoint: effort"),
        nullptr,
        {"actuators[0].drive.rated_torque: found nothing, expected the torque that the drive calls 1000"}},
       {"node: 1,",
        drive("setpoint: effort, rated_torque: 0 Nm"),
        nullptr,
        {"actuators[0].drive.rated_torque: found '0 Nm', expected a value above 0 Nm"}},
       {"node: 1,",
        drive("rated_torque: 1 Nm"),
        nullptr,
        {"actuators[0].drive.rated_torque: found '1 Nm', expected no such key, as drive.setpoint is "
         "displacement"}},
       // 8 N on 10 mm
       {"node: 1,",
        drive("setpoint: effort, rated_torque: 2 mNm"),
        nullptr,
        {"actuators[0].drive.rated_torque: found '2 mNm', expected at least 0.002441 Nm", "0.08 Nm"}},
       {"node: 1,",
        drive("setpoint: effort, rated_torque: 1 Nm, following_error: 1 mm"),
        nullptr,
        {"actuators[0].drive.following_error: found '1 mm', expected no such key, as drive.setpoint is "
         "effort"}}});
}

/// kGood with ODrive axes: nodes 1 and 2, positions in turns, absolute encoders, the heartbeats that the
/// drives come with.
std::string good_odrive() {
  using tendril::testing::replace_each;
  std::string yaml = kGood;
  replace_each(yaml, "counts_per_turn: ", ", ", "reference: absolute, ");
  replace_each(yaml, "  heartbeat", "\n", "");
  replace_each(yaml, "  master_node: ", "\n", "  protocol: odrive\n");
  return yaml;
}

/// What is said of it with one replacement.
std::string error_with(const std::string& from, const std::string& to) {
  std::string yaml = good_odrive();
  INFO(yaml << "\n" << from);
  REQUIRE(yaml.find(from) != std::string::npos);
  yaml.replace(yaml.find(from), from.size(), to);
  return error_of(RobotFile(yaml).path());
}

TEST_CASE("A robot with ODrive axes has the keys, ranges and defaults of that protocol", "[unit]") {
  CHECK(error_of(RobotFile(good_odrive()).path()) == "no error");
  std::string yaml = good_odrive();
  yaml.replace(yaml.find("node: 1,"), 8, "node: 0, velocity_limit: 1200 rpm, current_limit: 10 A,");
  yaml.replace(yaml.find("protocol: odrive"), 16,
               "protocol: odrive\n  firmware: 0.5\n  encoder_period: 2 ms");
  yaml += "  drives: {encoder_counts: 4096}\n";
  const Config c = load_config(RobotFile(yaml).path());
  CHECK(c.bus.master.protocol == &tendril::hal::odrive_protocol());
  CHECK(tendril::hal::odrive_settings(c.bus.master).firmware == tendril::hal::OdriveFirmware::k0_5);
  CHECK(tendril::hal::odrive_settings(c.bus.master).encoder_period_ns == 2'000'000);
  CHECK(c.bus.master.heartbeat_ns == 100'000'000);
  CHECK(c.bus.master.heartbeat_timeout_ns == 250'000'000);
  CHECK(c.actuators[0].drive.node == 0);
  CHECK(c.actuators[0].drive.scale.counts_per_turn == 1);
  CHECK(tendril::hal::odrive_settings(c.actuators[0].drive).velocity_limit == Approx(20));
  CHECK(tendril::hal::odrive_settings(c.actuators[0].drive).current_limit == Approx(10));
  CHECK(tendril::hal::odrive_settings(c.actuators[1].drive).velocity_limit == 0);
  CHECK(tendril::hal::settings_as<tendril::hal::OdriveSimulationSettings>(c.plant->drives.protocol_settings)
            .encoder_counts == 4096);
  CHECK_FALSE(c.plant->drives.position_gain);
}

TEST_CASE("The encoder of an ODrive axis turns as often as its gear says while the pulley turns once",
          "[unit]") {
  std::string yaml = good_odrive();
  yaml.replace(yaml.find("node: 1,"), 8, "node: 1, gear: 12.5, reversed: true,");
  const auto master = master_config(load_config(RobotFile(yaml).path()));
  const auto circumference = [](double radius) { return 2 * std::numbers::pi * radius; };
  CHECK(master.axes[0].scale.to_position(circumference(0.010)) == Approx(-12.5));
  CHECK(master.axes[1].scale.to_position(circumference(0.011)) == Approx(1));
  CHECK_NOTHROW(master.protocol->check(master));
}

TEST_CASE("An ODrive axis follows efforts as it is, its torques being in Nm", "[unit]") {
  CHECK(error_with("node: 1,", "node: 1, setpoint: effort,") == "no error");
  CHECK_THAT(error_with("node: 1,", "node: 1, setpoint: effort, rated_torque: 1 Nm,"),
             Catch::Contains("rated_torque: found '1 Nm', expected no such key, as bus.protocol is odrive"));
}

TEST_CASE("Keys that belong to the other protocol are refused, and so are ODrive's own mistakes", "[unit]") {
  using Catch::Contains;
  CHECK_THAT(
      error_with("node: 1,", "node: 1, counts_per_turn: 8192,"),
      Contains("actuators[0].drive.counts_per_turn: found '8192', expected no such key, as bus.protocol "
               "is odrive, whose positions are in turns of the encoder; gear says how many"));
  CHECK_THAT(error_with("node: 1,", "node: 1, gear: 0,"), Contains("actuators[0].drive.gear: found '0'"));
  CHECK_THAT(error_with("protocol: odrive", "protocol: odrive\n  master_node: 3"),
             Contains("bus.master_node: found '3', expected no such key"));
  CHECK_THAT(error_with("reference: absolute", "reference: homing"),
             Contains("actuators[0].drive.reference: found 'homing', expected absolute or power_on"));
  CHECK_THAT(error_with("reference: absolute, ", ""),
             Contains("actuators[0].drive.reference: found nothing, expected absolute, or power_on: does the "
                      "axis still know where it stands when its power was off"));
  CHECK(error_with("reference: absolute", "reference: power_on") == "no error");
  CHECK_THAT(error_with("node: 1,", "node: 64,"), Contains("expected a whole number from 0 to 63"));
  CHECK_THAT(error_with("node: 1,", "node: 63,"),
             Contains("actuators[0].drive.node: found '63', expected at most 62, as firmware 0.6 gives 63"));
  CHECK_THAT(error_with("protocol: odrive", "protocol: odrive\n  firmware: 0.4"),
             Contains("bus.firmware: found '0.4', expected 0.5 or 0.6"));
  CHECK_THAT(error_with("protocol: odrive", "protocol: odrive\n  encoder_period: 30 ms"),
             Contains("bus.feedback_timeout: found nothing, expected at least two positions' time, 0.06 s"));
  CHECK(error_with("protocol: odrive",
                   "protocol: odrive\n  encoder_period: 30 ms\n  feedback_timeout: 60 ms") == "no error");
  CHECK_THAT(error_with("node: 1,", "node: 1, current_limit: 5 A,"),
             Contains("actuators[0].drive.velocity_limit: found nothing, expected a velocity limit beside"));
  CHECK_THAT(error_with("plant:", "plant:\n  drives: {following_error: 0.1}"),
             Contains("plant.drives.following_error: found '0.1', expected no such key"));
  CHECK_THAT(error_with("node: 2,", "node: 1,"), Contains("the drive of 'north' has this one"));
  CHECK_THAT(error_with("protocol: odrive", "protocol: ethercat"),
             Contains("bus.protocol: found 'ethercat', expected canopen or odrive"));
  check_mistakes({{"node: 1,",
                   "node: 1, current_limit: 5 A,",
                   nullptr,
                   {"actuators[0].drive.current_limit: found '5 A', expected no such key, as bus.protocol is "
                    "canopen"}},
                  {"node: 1,",
                   "node: 1, gear: 5,",
                   nullptr,
                   {"actuators[0].drive.gear: found '5', expected no such key, as bus.protocol is canopen"}},
                  {"bitrate: 1 Mbit/s",
                   "bitrate: 1 Mbit/s\n  firmware: 0.6",
                   "  firmware",
                   {"bus.firmware: found '0.6', expected no such key"}}});
}

TEST_CASE("A robot has at most 32 actuators and 24 controlled coordinates", "[unit]") {
  const auto robot = [](int actuators, int effectors) {
    std::string yaml =
        "robot: big\nmesh: {file: body.msh}\nmaterial: {young_modulus: 1 MPa, poisson_ratio: 0, mass: 1 kg}\n"
        "fixed: base\nbus: {name: can0}\neffectors:\n";
    for (int i = 0; i < effectors; ++i) yaml += "  - {name: e" + std::to_string(i) + ", point: 0 0 1 m}\n";
    yaml += "actuators:\n";
    for (int i = 1; i <= actuators; ++i) {
      const std::string n = std::to_string(i);
      yaml += "  - {name: a" + n + ", cable: [body 0 0 1 m, guide 0 0 2 m], tension: 0 1 N, stroke: 0 1 mm, ";
      yaml += "top_speed: 1 m/s, drive: {node: " + n + ", counts_per_turn: 65536, pulley_radius: 1 cm}}\n";
    }
    return error_of(RobotFile(yaml).path());
  };
  CHECK(robot(32, 8) == "no error");
  CHECK_THAT(robot(33, 8),
             Catch::Contains(":15: actuators: found a list of 33, expected at most 32 actuators"));
  CHECK_THAT(
      robot(32, 9),
      Catch::Contains(
          ":6: effectors: found a list of 9, expected at most 24 controlled coordinates, these are 27"));
}

}  // namespace tendril::app::config_rules_test
