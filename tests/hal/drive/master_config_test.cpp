#include "hal/protocols/drive_protocol.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "hal/cia402/cia402_setup.h"
#include "tests/hal/rig.h"

namespace tendril::hal::master_config_test {
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
  refused("'cable 1': node 128", [](MasterConfig& c) { c.axes[1].node = 128; });
  refused("master's own", [](MasterConfig& c) { c.canopen.master_node = 2; });
  refused("both use identifier 0x81", [](MasterConfig& c) { c.axes[1].node = 1; });
  refused("counts per turn", [](MasterConfig& c) { c.axes[0].scale.counts_per_turn = 0; });
  refused("displacement per turn", [](MasterConfig& c) { c.axes[0].scale.displacement_per_turn = -1; });
  refused("sensor 'camera' and axis 'cable 0'", [](MasterConfig& c) { c.sensors = {camera(0x181)}; });
  refused("'camera' and sensor 'camera'", [](MasterConfig& c) { c.sensors.assign(2, camera(0x1F0)); });
  refused("'camera' would both use identifier 0x1F0", [](MasterConfig& c) {
    c.sensors.assign(2, camera(0x1F0));
    for (SensorConfig& sensor : c.sensors) sensor.extended = true;
  });
  refused("'camera': the identifier must fit", [](MasterConfig& c) { c.sensors = {camera(0x800)}; });
  refused("heartbeat timeout", [](MasterConfig& c) { c.heartbeat_timeout_ns = c.heartbeat_ns; });
  refused("control period", [](MasterConfig& c) { c.period_ns = 0; });
  refused("0x202", [](MasterConfig& c) { c.axes[0].canopen.rpdo_id = 0x202; });
  refused("'cable 1': a statusword has the bits 0..15",
          [](MasterConfig& c) { c.axes[1].canopen.referenced_bit = 16; });
  refused("the least displacement",
          [](MasterConfig& c) { c.axes[0].displacement_min = 1e-3, c.axes[0].displacement_max = 0; });
  refused("a following error", [](MasterConfig& c) { c.axes[0].canopen.following_error = -1e-3; });
  refused("the time for homing", [](MasterConfig& c) { c.axes[0].canopen.homing.timeout_ns = 0; });
}

TEST_CASE("An axis that follows efforts needs a range, and with CANopen a rated torque", "[unit]") {
  for (const bool odrive : {false, true}) {
    const MasterConfig sound = on_efforts(odrive ? odrive_config_of(2) : config_of(2), 1, 10e-3);
    CHECK_NOTHROW(check(sound));
    MasterConfig config = sound;
    config.axes[0].displacement_max = INFINITY;
    CHECK_THROWS_WITH(check(config), Catch::Contains("'cable 0': one that follows efforts must have limits"));
    config = sound;
    config.axes[0].canopen.rated_torque = 0;
    if (odrive)
      CHECK_NOTHROW(check(config));
    else
      CHECK_THROWS_WITH(check(config),
                        Catch::Contains("'cable 0': to follow efforts it must have a rated torque"));
  }
}

TEST_CASE("Homing in place, which each start would do elsewhere, needs the bit that tells it is done",
          "[unit]") {
  MasterConfig config = config_of(2);
  CanopenAxis& axis = config.axes[1].canopen;
  axis.reference = Reference::kHoming;
  for (const int8_t method : std::initializer_list<int8_t>{35, 37}) {
    axis.homing.method = method;
    axis.referenced_bit = -1;
    CHECK_THROWS_WITH(check(config), Catch::Contains("'cable 1': homing in place needs the statusword bit"));
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
  refused("'cable 1': node 64 is not within 0..63", [](MasterConfig& c) { c.axes[1].node = 64; });
  refused("'cable 1': node 63 is that of axes without an address",
          [](MasterConfig& c) { c.axes[1].node = 63; });
  refused("'cable 1': node -1", [](MasterConfig& c) { c.axes[1].node = -1; });
  refused("both use identifier 0x0", [](MasterConfig& c) { c.axes[1].node = 0; });
  refused("positions are in turns", [](MasterConfig& c) { c.axes[0].scale.counts_per_turn = 8192; });
  refused("'camera' and axis 'cable 1' (node 1)", [](MasterConfig& c) { c.sensors = {camera(0x3F)}; });
  refused("both positive", [](MasterConfig& c) { c.axes[0].odrive.current = 10; });
  refused("both positive", [](MasterConfig& c) { c.axes[0].odrive = {-1, -1}; });
  refused("encoder estimates", [](MasterConfig& c) { c.odrive.encoder_period_ns = 30'000'000; });
  refused("encoder estimates", [](MasterConfig& c) { c.odrive.encoder_period_ns = 0; });
  MasterConfig config = odrive_config_of(2);
  config.sensors = {camera(0x40)};  // node 2 is nobody's
  CHECK_NOTHROW(check(config));
  config.axes[1].node = 63;
  config.odrive.firmware = OdriveFirmware::k0_5;
  CHECK_NOTHROW(check(config));
}

TEST_CASE("COB-IDs follow the predefined connection set unless they are given", "[unit]") {
  AxisConfig axis{.name = "a", .node = 2};
  CHECK(rpdo_cob_id(axis) == 0x202);
  CHECK(tpdo_cob_id(axis) == 0x182);
  axis.canopen.pdo = 3;
  CHECK(rpdo_cob_id(axis) == 0x402);
  CHECK(tpdo_cob_id(axis) == 0x382);
  axis.canopen.tpdo_id = 0x3A0;
  CHECK(tpdo_cob_id(axis) == 0x3A0);
}

}  // namespace tendril::hal::master_config_test
