// SPDX-License-Identifier: Apache-2.0

#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <string>

#include "hal/cia402/cia402_setup.h"
#include "hal/drive/drive_protocol.h"
#include "tests/hal/rig.h"

namespace tendril::hal::master_config_test {

void check(const MasterConfig& config) { config.protocol->check(config); }

using tendril::hal::test::camera;
using tendril::hal::test::config_of;
using tendril::hal::test::odrive_config_of;
using tendril::hal::test::on_efforts;

TEST_CASE("A sound configuration passes and each unsound one says what is wrong", "[unit]") {
  CHECK_NOTHROW(check(config_of(1)));
  CHECK_NOTHROW(check(config_of(32)));
  const auto refused = [](const std::string& words, auto spoil) {
    MasterConfig config = config_of(2);
    spoil(config);
    CHECK_THROWS_WITH(check(config), Catch::Contains(words));
  };
  refused("1..32 axes", [](MasterConfig& c) { c.axes.clear(); });
  refused("'cable 1' (node 128): node: expected a node id from 1 to 127",
          [](MasterConfig& c) { c.axes[1].node = 128; });
  refused("the controller (bus.master_node) has this one",
          [](MasterConfig& c) { cia402_settings(c).master_node = 2; });
  refused("(node 1): node: expected a node id of its own, the drive of 'cable 0' has this one",
          [](MasterConfig& c) { c.axes[1].node = 1; });
  refused("counts_per_turn: expected", [](MasterConfig& c) { c.axes[0].scale.counts_per_turn = 0; });
  refused("displacement_per_turn: expected",
          [](MasterConfig& c) { c.axes[0].scale.displacement_per_turn = -1; });
  refused("sensor 'camera': id: expected an identifier that is free; this is TPDO 1 of node 1",
          [](MasterConfig& c) { c.sensors = {camera(0x181)}; });
  refused("this is that of sensor 'camera'", [](MasterConfig& c) { c.sensors.assign(2, camera(0x1F0)); });
  refused("this is that of sensor 'camera'", [](MasterConfig& c) {
    c.sensors.assign(2, camera(0x1F0));
    for (SensorConfig& sensor : c.sensors) sensor.extended = true;
  });
  refused("'camera': the identifier must fit", [](MasterConfig& c) { c.sensors = {camera(0x800)}; });
  refused("heartbeat_timeout: expected at least two heartbeats, 0.1 s (it is 0.05 s)",
          [](MasterConfig& c) { c.heartbeat_timeout_ns = c.heartbeat_ns; });
  refused("heartbeat_timeout: expected at least three control periods, 0.15 s, as the drives hear of the",
          [](MasterConfig& c) {
            c.period_ns = 50'000'000;
            c.heartbeat_timeout_ns = 3 * c.period_ns - 1;
          });
  refused("control period", [](MasterConfig& c) { c.period_ns = 0; });
  refused("0x202", [](MasterConfig& c) { cia402_settings(c.axes[0]).rpdo_id = 0x202; });
  refused("'cable 1' (node 2): referenced_bit: expected a bit of the statusword",
          [](MasterConfig& c) { cia402_settings(c.axes[1]).referenced_bit = 16; });
  refused("stroke: expected a least displacement",
          [](MasterConfig& c) { c.axes[0].displacement_min = 1e-3, c.axes[0].displacement_max = 0; });
  refused("following_error: expected", [](MasterConfig& c) { c.axes[0].following_error = -1e-3; });
  refused("homing.timeout: expected", [](MasterConfig& c) {
    cia402_settings(c.axes[0]).reference = Reference::kHoming;
    cia402_settings(c.axes[0]).homing.timeout_ns = 0;
  });
}

TEST_CASE("Three control periods of either protocol are enough for the drives to hear of the controller",
          "[unit]") {
  for (MasterConfig config : {config_of(2), odrive_config_of(2)}) {
    config.period_ns = 100'000'000;
    config.feedback_timeout_ns = 1'000'000'000;
    config.heartbeat_timeout_ns = 3 * config.period_ns;
    CHECK_NOTHROW(check(config));
    --config.heartbeat_timeout_ns;
    CHECK_THROWS_WITH(check(config), Catch::Contains("at least three control periods, 0.3 s"));
  }
}

TEST_CASE("An axis that follows efforts needs a range, and with CANopen a rated torque", "[unit]") {
  for (const bool odrive : {false, true}) {
    const MasterConfig sound = on_efforts(odrive ? odrive_config_of(2) : config_of(2), 1, 10e-3);
    CHECK_NOTHROW(check(sound));
    MasterConfig config = sound;
    config.axes[0].displacement_max = INFINITY;
    CHECK_THROWS_WITH(
        check(config),
        Catch::Contains("'cable 0' (node") &&
            Catch::Contains("stroke: expected limits of the displacement, as it follows efforts"));
    if (odrive) continue;
    config = sound;
    cia402_settings(config.axes[0]).rated_torque = 0;
    CHECK_THROWS_WITH(
        check(config),
        Catch::Contains("'cable 0' (node 1): rated_torque: expected the torque that the drive calls 1000"));
  }
}

TEST_CASE("Homing in place, which each start would do elsewhere, needs the bit that tells it is done",
          "[unit]") {
  MasterConfig config = config_of(2);
  Cia402AxisSettings& axis = cia402_settings(config.axes[1]);
  axis.reference = Reference::kHoming;
  for (const int8_t method : std::initializer_list<int8_t>{35, 37}) {
    axis.homing.method = method;
    axis.referenced_bit = -1;
    CHECK_THROWS_WITH(check(config),
                      Catch::Contains("'cable 1' (node 2): referenced_bit: expected the statusword bit"));
    axis.referenced_bit = 15;
    CHECK_NOTHROW(check(config));
  }
  axis.homing.method = 17;
  axis.referenced_bit = -1;
  CHECK_NOTHROW(check(config));
}

TEST_CASE("What ODrive asks of a configuration is checked, and each mistake named", "[unit]") {
  CHECK_NOTHROW(check(odrive_config_of(1)));
  CHECK_NOTHROW(check(odrive_config_of(32)));
  const auto refused = [](const std::string& words, auto spoil) {
    MasterConfig config = odrive_config_of(2);
    spoil(config);
    CHECK_THROWS_WITH(check(config), Catch::Contains(words));
  };
  refused("1..32 axes", [](MasterConfig& c) { c.axes.clear(); });
  refused("'cable 1' (node 64): node: expected a node id from 0 to 63",
          [](MasterConfig& c) { c.axes[1].node = 64; });
  refused("'cable 1' (node 63): node: expected at most 62", [](MasterConfig& c) { c.axes[1].node = 63; });
  refused("'cable 1' (node -1): node", [](MasterConfig& c) { c.axes[1].node = -1; });
  refused("the drive of 'cable 0' has this one", [](MasterConfig& c) { c.axes[1].node = 0; });
  refused("counts_per_turn: expected 1, as positions are in turns",
          [](MasterConfig& c) { c.axes[0].scale.counts_per_turn = 8192; });
  refused("this is message 0x1F of node 1", [](MasterConfig& c) { c.sensors = {camera(0x3F)}; });
  refused("velocity_limit: expected", [](MasterConfig& c) { odrive_settings(c.axes[0]).current_limit = 10; });
  refused("velocity_limit: expected", [](MasterConfig& c) { odrive_settings(c.axes[0]) = {-1, -1, false}; });
  refused("feedback_timeout: expected at least two positions' time, 0.06 s (it is 0.05 s)",
          [](MasterConfig& c) { odrive_settings(c).encoder_period_ns = 30'000'000; });
  refused("encoder_period: expected", [](MasterConfig& c) { odrive_settings(c).encoder_period_ns = 0; });
  MasterConfig config = odrive_config_of(2);
  config.sensors = {camera(0x40)};  // node 2 is nobody's
  CHECK_NOTHROW(check(config));
  config.axes[1].node = 63;
  odrive_settings(config).firmware = OdriveFirmware::k0_5;
  CHECK_NOTHROW(check(config));
}

/// Of the 11-bit identifiers those that a sensor may not have, and why.
std::map<uint32_t, std::string> refused_to_sensors(MasterConfig config) {
  std::map<uint32_t, std::string> refused;
  for (uint32_t id = 0; id <= 0x7FF; ++id) {
    config.sensors = {camera(id)};
    try {
      check(config);
    } catch (const SettingError& error) {
      CHECK(error.section == SettingError::Section::kSensor);
      CHECK(error.key == "id");
      refused[id] = error.expected;
    }
  }
  return refused;
}

TEST_CASE("A sensor may have no identifier that CiA 301 gives to a node, and any other", "[unit]") {
  const auto refused = refused_to_sensors(config_of(2));
  CHECK(refused.size() == 2 + 3 * 12);  // emergency, four PDOs each way, SDO each way, heartbeat
  CHECK_THAT(refused.at(0x000), Catch::EndsWith("this is the NMT command"));
  CHECK_THAT(refused.at(0x080), Catch::EndsWith("this is SYNC"));
  for (const uint32_t id :
       {0x081, 0x181, 0x201, 0x281, 0x301, 0x381, 0x401, 0x481, 0x501, 0x581, 0x601, 0x701}) {
    CAPTURE(id);
    CHECK_THAT(refused.at(id), Catch::EndsWith("of node 1"));
    CHECK(refused.count(id + 2) == 0);
  }
  CHECK_THAT(refused.at(0x77F), Catch::EndsWith("the heartbeat of node 127"));
  MasterConfig config = config_of(2);
  cia402_settings(config.axes[1]).rpdo_id = 0x1F1;
  CHECK_THAT(refused_to_sensors(config).at(0x1F1),
             Catch::EndsWith("that of a PDO of the drive of 'cable 1'"));
}

TEST_CASE("A sensor may have none of the 32 identifiers of an ODrive axis, and any other", "[unit]") {
  MasterConfig config = odrive_config_of(2);
  config.axes[1].node = 3;
  const auto refused = refused_to_sensors(config);
  CHECK(refused.size() == 64);
  CHECK_THAT(refused.at(0x001), Catch::EndsWith("this is message 0x01 of node 0"));
  CHECK_THAT(refused.at(0x07F), Catch::EndsWith("this is message 0x1F of node 3"));
}

TEST_CASE("COB-IDs follow the predefined connection set unless they are given", "[unit]") {
  AxisConfig axis{.name = "a", .node = 2};
  CHECK(rpdo_cob_id(axis) == 0x202);
  CHECK(tpdo_cob_id(axis) == 0x182);
  cia402_settings(axis).pdo = 3;
  CHECK(rpdo_cob_id(axis) == 0x402);
  CHECK(tpdo_cob_id(axis) == 0x382);
  cia402_settings(axis).tpdo_id = 0x3A0;
  CHECK(tpdo_cob_id(axis) == 0x3A0);
}

}  // namespace tendril::hal::master_config_test
