#include "hal/master_config.h"

#include <catch2/catch.hpp>

#include "rig.h"

using namespace tendril::hal;
using tendril::hal::test::config_of;

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
  refused("master's own", [](MasterConfig& c) { c.master_node = 2; });
  refused("both use identifier 0x81", [](MasterConfig& c) { c.axes[1].node = 1; });
  refused("counts per turn", [](MasterConfig& c) { c.axes[0].scale.counts_per_turn = 0; });
  refused("displacement per turn", [](MasterConfig& c) { c.axes[0].scale.displacement_per_turn = -1; });
  refused("the tracker and axis 'cable 0'", [](MasterConfig& c) { c.tracker_id = 0x181; });
  refused("heartbeat timeout", [](MasterConfig& c) { c.heartbeat_timeout_ns = c.heartbeat_ns; });
  refused("SYNC period", [](MasterConfig& c) { c.period_ns = 0; });
  refused("0x202", [](MasterConfig& c) { c.axes[0].rpdo_id = 0x202; });
}

TEST_CASE("COB-IDs follow the predefined connection set unless they are given", "[unit]") {
  AxisConfig axis{.name = "a", .node = 2};
  CHECK(axis.rpdo_cob_id() == 0x202);
  CHECK(axis.tpdo_cob_id() == 0x182);
  axis.pdo = 3;
  CHECK(axis.rpdo_cob_id() == 0x402);
  CHECK(axis.tpdo_cob_id() == 0x382);
  axis.tpdo_id = 0x3A0;
  CHECK(axis.tpdo_cob_id() == 0x3A0);
}
