// SPDX-License-Identifier: Apache-2.0
#include "app/config/config_sensors.h"

#include <catch2/catch.hpp>

#include "app/config/load_config.h"
#include "app/config/master_config.h"
#include "app/config/readings.h"
#include "app/robot/robot.h"
#include "hal/drive/drive_protocol.h"
#include "tests/app/config/mistake.h"
#include "tests/app/robot_file.h"

namespace tendril::app::config_sensors_test {
using Catch::Contains;

/// kGood with a camera, and load cells on both cables.
std::string sensing() {
  return kGood + R"(sensors:
  - name: camera
    id: 0x1F0
    rate: 100 Hz
    timeout: 100 ms
    signals:
      - {effector: tip, coordinate: x, start: 0, length: 16, type: signed, scale: 0.01 mm}
      - {effector: tip, coordinate: z, start: 16, length: 16, type: signed, scale: 0.01 mm}
    age: {start: 48, length: 16, scale: 0.01 ms}
  - name: cells
    id: 0x1F1
    rate: 500 Hz
    on_loss: stop
    signals:
      - {tension: north, start: 7, length: 32, byte_order: motorola, type: float, scale: 1 N}
      - {tension: south, start: 39, length: 12, byte_order: motorola, scale: 10 mN, offset: -5 N}
)";
}

std::string error_with(const std::string& from, const std::string& to) {
  std::string yaml = sensing();
  REQUIRE(yaml.find(from) != std::string::npos);
  yaml.replace(yaml.find(from), from.size(), to);
  return error_of(RobotFile(yaml).path());
}

TEST_CASE("The bus is told of the sensors as the file describes them, in SI", "[unit]") {
  const Config config = load_config(RobotFile(sensing()).path());
  const auto sensors = master_config(config).sensors;
  REQUIRE(sensors.size() == 2);
  CHECK_NOTHROW(tendril::hal::check(sensors));
  CHECK_FALSE(sensors[0].required);
  CHECK(sensors[1].required);
  CHECK(sensors[1].length == 6);
  CHECK(sensors[1].rate_hz == 500);
  CHECK(sensors[1].timeout_ns == 100'000'000);
  CHECK(sensors[1].signals[1].scale == Approx(0.01));
  CHECK(sensors[1].signals[1].offset == -5);
}

TEST_CASE("A reading stands where the bus puts its signal: those of the sensors before it count", "[unit]") {
  const Config config = load_config(RobotFile(sensing()).path());
  const auto all = readings(config);
  REQUIRE(all.size() == 4);
  for (int k = 0; k < 4; ++k) CHECK(all[k].signal == k);
  CHECK(all[0].sensor == 0);
  CHECK(all[1].sensor == 0);
  CHECK(all[1].measures == MeasuredConfig{.effector = 0, .axis = 2});
  CHECK(all[2].sensor == 1);
  CHECK(all[2].measures == MeasuredConfig{.actuator = 0});
  CHECK(all[3].sensor == 1);
}

TEST_CASE("Each mistake in a sensor is told with its place and what is expected", "[unit]") {
  const std::string north = "{tension: north, ", tip = "{effector: tip, coordinate: x";
  check_mistakes(
      {
          {"id: 0x1F1",
           "id: 0x800",
           nullptr,
           {"sensors[1].id: found '0x800', expected at most 0x7FF, or extended: true beside it"}},
          {"id: 0x1F1",
           "id: 0x20000000\n    extended: true",
           "id: 0x20000000",
           {"sensors[1].id: found '0x20000000', expected a whole number from 0 to 536870911"}},
          {"    rate: 500 Hz\n", "", "- name: cells", {"missing key 'rate'"}},
          {"on_loss: stop",
           "on_loss: cry",
           nullptr,
           {"sensors[1].on_loss: found 'cry', expected warn or stop"}},
          {"timeout: 100 ms",
           "timeout: 19 ms",
           nullptr,
           {"sensors[0].timeout: found '19 ms', expected at least two frames' time, 0.02 s"}},
          {tip,
           "{effector: top, coordinate: x",
           nullptr,
           {"signals[0].effector: found 'top', expected the name"}},
          {tip,
           "{effector: tip, coordinate: w",
           nullptr,
           {"signals[0].coordinate: found 'w', expected x or y or z"}},
          {tip, "{effector: tip", nullptr, {"missing key 'coordinate'"}},
          {tip, "{coordinate: x", nullptr, {"expected one of: effector, tension, force, pressure"}},
          {tip, "{tension: north, effector: tip", nullptr, {"found keys 'effector' and 'tension'"}},
          {north,
           "{tension: nirth, ",
           nullptr,
           {"signals[0].tension: found 'nirth', expected the name of a cable"}},
          {north, "{pressure: north, ", nullptr, {"found 'north', expected the name of a cavity's actuator"}},
          {north, "{force: north, ", nullptr, {"found 'north', expected the name of a rod or a force"}},
          {"scale: 10 mN", "scale: 10 mm", nullptr, {"signals[1].scale: found '10 mm', expected a force"}},
          {"scale: 10 mN",
           "scale: 0 mN",
           nullptr,
           {"signals[1].scale: found '0 mN', expected a scale other than 0"}},
          {"length: 16, scale: 0.01 ms",
           "length: 16, scale: 0.01 mm",
           nullptr,
           {"sensors[0].age.scale", "duration"}},
          {"start: 48", "start: 64", nullptr, {"sensors[0].age.start: found '64'", "from 0 to 63"}},
          {"start: 48",
           "start: 49",
           nullptr,
           {"sensors[0].age.length: found '16', expected fewer bits: from bit 49"}},
          {"length: 32",
           "length: 24",
           nullptr,
           {"signals[0].length: found '24', expected 32 or 64 bits, as"}},
          {"start: 39",
           "start: 24",
           nullptr,
           {"sensors[1].signals[1].start: found '24', expected bits that no other"}},
          {"start: 48", "start: 31", "start: 16", {"sensors[0].signals[1].start", "the age included"}},
          {"    on_loss: stop",
           "    length: 5",
           nullptr,
           {"sensors[1].length: found '5', expected at least 6 bytes, so far reach the signals"}},
      },
      sensing());
}

TEST_CASE("An effector that is a cavity has no coordinates to be measured", "[unit]") {
  std::string yaml = sensing();
  yaml.replace(yaml.find("actuators:"), 0, "  - {name: volume, cavity: chamber}\n");
  yaml.replace(yaml.find("effector: tip"), 13, "effector: volume");
  CHECK_THAT(error_of(RobotFile(yaml).path()),
             Contains("signals[0].effector: found 'volume', expected an effector of points"));
}

TEST_CASE("Sensors do not share names, quantities or identifiers, with each other or with drives", "[unit]") {
  check_mistakes(
      {
          {"name: cells",
           "name: camera",
           "name: camera\n    id: 0x1F1",
           {"sensors[1].name", "sensors[0] has this one"}},
          {"coordinate: z",
           "coordinate: x",
           "start: 16",
           {"sensors[0].signals[1]", "sensors[0].signals[0] does"}},
          {"{tension: south,",
           "{tension: north,",
           "start: 39",
           {"sensors[1].signals[1]", "sensors[1].signals[0] does"}},
          {"id: 0x1F1",
           "id: 0x1F0",
           "id: 0x1F0\n    rate: 500",
           {"sensors[1].id", "this is that of sensor 'camera'"}},
          {"id: 0x1F1", "id: 0x182", nullptr, {"sensors[1].id: found '0x182'", "this is TPDO 1 of node 2"}},
          {"id: 0x1F1", "id: 128", nullptr, {"this is SYNC"}},
          {"id: 0x1F1", "id: 0x77F", nullptr, {"the heartbeat of node 127"}},
          {"{node: 2,",
           "{node: 2, rpdo_id: 0x1F1,",
           "id: 0x1F1\n",
           {"sensors[1].id: found '0x1F1'", "that of a PDO of the drive of 'south'"}},
      },
      sensing());
  CHECK(error_with("id: 0x1F1", "id: 0x1F2") == "no error");
}

TEST_CASE("Identifiers of 29 bits are others than those of 11 bits, and belong to no drive", "[unit]") {
  for (const std::string id : {"0x1F0", "0x182", "0x18FF50E5"}) {
    CAPTURE(id);
    std::string yaml = sensing();
    yaml.replace(yaml.find("id: 0x1F1"), 9, "id: " + id + "\n    extended: true");
    const auto master = master_config(load_config(RobotFile(yaml).path()));
    CHECK(master.sensors[1].extended);
    CHECK_FALSE(master.sensors[0].extended);
    CHECK_NOTHROW(master.protocol->check(master));
  }
  CHECK_THAT(error_with("    id: 0x1F0", "    extended: true\n    id: 0x1F1"), Contains("no error"));
  std::string twins = sensing();
  twins.replace(twins.find("id: 0x1F0"), 9, "id: 0x1FFFFFF0\n    extended: true");
  twins.replace(twins.find("id: 0x1F1"), 9, "id: 0x1FFFFFF0\n    extended: true");
  CHECK_THAT(error_of(RobotFile(twins).path()),
             Contains("sensors[1].id") && Contains("that of sensor 'camera'"));
}

TEST_CASE("A robot has at most 32 sensors, and 64 signals", "[unit]") {
  const auto robot = [](int sensors) {
    std::string yaml = kGood + "sensors:\n";
    for (int s = 0; s < sensors; ++s)
      yaml += "  - {name: s" + std::to_string(s) + ", id: " + std::to_string(0x680 + s) +
              ", rate: 1 kHz, signals: [{tension: north, start: 0, length: 8, scale: 1 N}]}\n";
    return error_of(RobotFile(yaml).path());
  };
  CHECK_THAT(robot(33), Contains("sensors: found a list of 33, expected at most 32 sensors"));

  std::string yaml = kGood, effectors;
  for (int k = 0; k < 21; ++k)
    effectors += "  - {name: e" + std::to_string(k) + ", point: 0 0 1 m, coordinates: x, weight: 0}\n";
  yaml.insert(yaml.find("actuators:"), effectors);
  yaml += "sensors:\n";
  const auto measured = [](int k, char coordinate, int start) {
    return "      - {effector: e" + std::to_string(k) + ", coordinate: " + coordinate +
           ", start: " + std::to_string(start) + ", length: 8, scale: 1 mm}\n";
  };
  for (int k = 0; k < 21; ++k)
    yaml += "  - name: s" + std::to_string(k) + "\n    id: " + std::to_string(0x680 + k) +
            "\n    rate: 1 kHz\n    signals:\n" + measured(k, 'x', 0) + measured(k, 'y', 8) +
            measured(k, 'z', 16);
  CHECK(error_of(RobotFile(yaml).path()) == "no error");
  yaml +=
      "  - {name: last, id: 0x7A0, rate: 1 kHz, signals: [{tension: north, start: 0, length: 8, scale: 1 N}, "
      "{tension: south, start: 8, length: 8, scale: 1 N}]}\n";
  CHECK_THAT(error_of(RobotFile(yaml).path()), Contains("expected at most 64 signals in all, these are 65"));
}

}  // namespace tendril::app::config_sensors_test
