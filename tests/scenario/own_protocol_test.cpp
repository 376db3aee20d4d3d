// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "app/check/cycle_budget.h"
#include "app/config/config_error.h"
#include "app/config/load_config.h"
#include "app/robot/bus_check.h"
#include "tests/own_folder.h"
#include "tests/replace_each.h"
#include "tests/scenario/robot_files.h"
#include "tests/scenario/serial_protocol.h"

// A protocol that is one file and one row of a table goes through the whole of Tendril: robot file, check,
// budget, loop, simulated drives, virtual time. It has nothing of CAN: packets of up to 64 bytes on a serial
// line.

namespace tendril::app::own_protocol_test {

using Catch::Matchers::Contains;
using rt::Phase;

constexpr double kStartedWithin_s = 3.0, kStoppedWithin_s = 2.0;

/// The finger's robot file for such a line.
/// @param node_of_left  of the second drive, with what else its section holds
Config load(const std::string& node_of_left = "2") {
  const std::filesystem::path shipped = std::filesystem::path(TENDRIL_SOURCE_DIR) / "config";
  std::ifstream original(shipped / "finger.yaml");
  std::string yaml(std::istreambuf_iterator<char>(original), {});
  const auto replace = [&](const char* begin, const char* end, const std::string& instead) {
    tendril::testing::replace_each(yaml, begin, end, instead);
  };
  replace("file: ", "", "file: " + shipped.string() + "/");
  replace("  master_node: ", "\n", "  protocol: serial\n");
  replace("  heartbeat: ", "\n", "");
  replace("node: 2,", "", "node: " + node_of_left + ",");
  const tendril::testing::OwnFolder folder;
  const std::filesystem::path file = folder / "finger.yaml";
  std::ofstream(file) << yaml;
  const std::array<const hal::DriveProtocol*, 1> protocols = {&testing::serial_protocol()};
  return load_config(file, nullptr, protocols);
}

TEST_CASE("A robot file may name a protocol of one's own, whose keys are checked like all others",
          "[scenario]") {
  const Config config = load();
  CHECK(config.bus.master.protocol == &testing::serial_protocol());
  CHECK(config.actuators[1].drive.node == 2);
  CHECK_THROWS_WITH(load("254"), Contains("finger.yaml:") && Contains("node: found '254'"));
  CHECK_THROWS_WITH(load("1"), Contains("the drive of 'right' has this one"));
  CHECK_THROWS_WITH(load("2, setpoint: effort"),
                    Contains("setpoint") && Contains("these drives take positions"));
}

TEST_CASE("The budget counts the bytes of a serial line", "[scenario]") {
  Config config = load();
  config.sensors.clear();
  // 11 bytes of commands, 5 from each drive, 10 bits each, 600 times a second.
  CHECK(check_bus(config).load == Approx(600 * 10 * (11 + 2 * 5) / 1e6));
}

TEST_CASE("Simulated drives of one's own protocol follow the control loop on a local bus", "[scenario]") {
  const Config config = load();
  const auto robot = build_model(config);
  CHECK(time_cycle(*robot, config).read_s > 0);
}

TEST_CASE("In virtual time a robot with a protocol of one's own follows its path as well as with CANopen",
          "[scenario]") {
  const auto error_mm = [](const Config& config) {
    VirtualRig rig(config, {});
    REQUIRE(rig.run_until(Phase::kRunning, kStartedWithin_s));
    rig.run_for(4);
    REQUIRE(rig.phase() == Phase::kRunning);
    CHECK(rig.heap_calls() == 0);
    CHECK(testing::within_limits(config, rig.trace()));
    return testing::mean(testing::tracking_errors_mm(config, rig));
  };
  CHECK(error_mm(load()) == Approx(error_mm(testing::finger())).epsilon(0.1));
}

TEST_CASE(
    "The end of a run disables drives of one's own protocol, and their alarm stops it with its axis named",
    "[scenario]") {
  VirtualRig rig(load(), {});
  REQUIRE(rig.run_until(Phase::kRunning, kStartedWithin_s));
  SECTION("asked to stop") {
    rig.requests().stop = true;
    REQUIRE(rig.run_until(Phase::kStopped, kStoppedWithin_s));
    CHECK_FALSE(rig.controller().latched().present);
  }
  SECTION("an alarm") {
    rig.drives().inject({.kind = PlantFaultKind::kDriveFault, .axis = 1, .value = 1});
    REQUIRE(rig.run_until(Phase::kStopped, kStoppedWithin_s));
    REQUIRE(rig.controller().latched().present);
    CHECK_THAT(rig.master().describe(rig.controller().latched().drive), Contains("'left'"));
  }
  SECTION("silence") {
    rig.plant_plug().set_plugged(false);
    REQUIRE(rig.run_until(Phase::kStopped, kStoppedWithin_s));
    CHECK(rig.controller().latched().drive.kind == hal::FaultKind::kFeedbackLost);
  }
  for (int a = 0; a < 2; ++a) CHECK(rig.drives().drive(a).power_stage() != hal::PowerStage::kOn);
}

}  // namespace tendril::app::own_protocol_test
