// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "app/config/plant_fault.h"
#include "app/config/plant_fault_parser.h"
#include "tests/scenario/robot_files.h"

// A fault, its cause removed, a reset: in virtual time, on the finger with drives of both protocols.

namespace tendril::app::reset_test {

using rt::Phase;

constexpr double kOneCount_m = 2e-6;  // more than a count of the finger's encoders

Config waiting(const std::string& protocol) {
  Config config = protocol == "odrive" ? testing::with_odrive("finger") : testing::finger();
  config.control.on_fault = OnFault::kWait;
  return config;
}

/// @return  whether the phase was reached
bool go_to(VirtualRig& rig, Phase phase, double seconds) {
  for (double t = 0; t < seconds && rig.phase() != phase; t += 0.002) rig.run_for(0.002);
  return rig.phase() == phase;
}

TEST_CASE(
    "Once the cause of a fault has gone, a reset enables the drives where they stand, and the robot goes on",
    "[scenario]") {
  const std::string protocol = GENERATE("canopen", "odrive");
  const std::string line =
      GENERATE("fault left", "heartbeat left off", "drop 100 %", "bus off", "stuck left");
  Config config = waiting(protocol);
  const std::string fault =
      line == "fault left" ? line + (protocol == "odrive" ? " error 0x40" : " emcy 0x2310") : line;
  CAPTURE(protocol, fault);
  VirtualRig rig(config, {});
  REQUIRE(go_to(rig, Phase::kRunning, 3));
  rig.run_for(0.8);
  rig.drives().inject(parse_plant_fault(fault, config));
  REQUIRE(go_to(rig, Phase::kStandby, 5));
  REQUIRE(rig.controller().latched().present);
  INFO(rig.stop_reason());
  rig.run_for(0.5);
  for (int a = 0; a < 2; ++a) CHECK(rig.drives().drive(a).power_stage() != hal::PowerStage::kOn);

  rig.drives().inject(parse_plant_fault("clear", config));
  rig.run_for(0.1);
  const PlantDisplacements before = rig.displacements();
  rig.requests().reset();
  REQUIRE(go_to(rig, Phase::kRunning, 10));
  CHECK_FALSE(rig.controller().latched().present);
  for (int a = 0; a < 2; ++a) {
    CHECK(rig.drives().drive(a).power_stage() == hal::PowerStage::kOn);
    CHECK(std::abs(rig.displacements().delta_a[a] - before.delta_a[a]) < kOneCount_m);
    CHECK(std::abs(rig.trace().back().command[a] - before.delta_a[a]) < kOneCount_m);
  }
  rig.run_for(1.5);
  CHECK(rig.phase() == Phase::kRunning);
  CHECK(rig.trace().back().faults.bits() == 0);
  CHECK(testing::within_limits(config, rig.trace()));
  CHECK(rig.heap_calls() == 0);
}

TEST_CASE(
    "A reset while the cause is still there stops the robot with the same reason, and a later one succeeds",
    "[scenario]") {
  const std::string protocol = GENERATE("canopen", "odrive");
  const Config config = waiting(protocol);
  VirtualRig rig(config, {});
  REQUIRE(go_to(rig, Phase::kRunning, 3));
  rig.drives().inject(parse_plant_fault("bus off", config));
  REQUIRE(go_to(rig, Phase::kStandby, 5));
  rig.requests().reset();
  REQUIRE(go_to(rig, Phase::kConnecting, 1));
  REQUIRE(go_to(rig, Phase::kStandby, 30));
  CHECK(rig.controller().latched().present);
  rig.drives().inject(parse_plant_fault("clear", config));
  rig.run_for(0.1);
  rig.requests().reset();
  REQUIRE(go_to(rig, Phase::kRunning, 10));
}

TEST_CASE("Actuators that were moved by hand while they had no torque stay there when they are enabled",
          "[scenario]") {
  const Config config = waiting("canopen");
  VirtualRig rig(config, {});
  REQUIRE(go_to(rig, Phase::kRunning, 3));
  rig.run_for(0.8);
  rig.requests().standby = true;
  REQUIRE(go_to(rig, Phase::kStandby, 2));
  rig.run_for(0.5);
  const PlantDisplacements before = rig.displacements();
  rig.requests().standby = false;
  REQUIRE(go_to(rig, Phase::kRunning, 3));
  for (int a = 0; a < 2; ++a)
    CHECK(std::abs(rig.displacements().delta_a[a] - before.delta_a[a]) < kOneCount_m);
  // The model rests where the drives stand, not where the efforts of the run before would have put it.
  const rt::TraceRecord& first = rig.trace().back();
  CHECK(first.p_e[0] == Approx(rig.measurements().back().tip.x()).margin(1e-3));
}

}  // namespace tendril::app::reset_test
