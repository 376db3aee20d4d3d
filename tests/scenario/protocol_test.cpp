// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "tests/scenario/robot_files.h"

// The same robot with drives of either protocol: what is above the drives must not notice.

namespace tendril::app::protocol_test {

using Catch::Matchers::Contains;
using rt::Phase;

constexpr double kStartedWithin_s = 3.0;
// 250 us between looks at the bus, a cycle of 1.7 ms in the drive and its interpolation, at 25 mm/s.
constexpr double kLag_mm = 0.1;

double mean_error_mm(const Config& config, double seconds, double model_rate_hz) {
  VirtualRig rig(config, {.model_rate_hz = model_rate_hz});
  rig.run_for(seconds);
  REQUIRE(rig.phase() == Phase::kRunning);
  for (const rt::TraceRecord& record : rig.trace()) REQUIRE(record.faults.bits() == 0);
  CHECK(rig.heap_calls() == 0);
  CHECK(testing::within_limits(config, rig.trace()));
  return testing::mean(testing::tracking_errors_mm(config, rig));
}

TEST_CASE("The diamond follows its square with ODrive axes as with CiA 402 drives", "[figures]") {
  const double cia402 = mean_error_mm(testing::diamond(), 3.5, 30);
  const double odrive = mean_error_mm(testing::with_odrive("diamond"), 3.5, 30);
  CAPTURE(cia402, odrive);
  CHECK(odrive == Approx(cia402).margin(kLag_mm));
}

TEST_CASE("Enabling ODrive axes moves nothing, wherever the winches stand", "[scenario]") {
  const std::string firmware = GENERATE("0.5", "0.6");
  const Config config = testing::with_odrive("finger", firmware);
  VirtualSettings settings;
  settings.start.delta_a = {0.0021, -0.0007};
  VirtualRig rig(config, settings);
  REQUIRE(rig.run_until(Phase::kRunning, kStartedWithin_s));
  for (int a = 0; a < 2; ++a) {
    // Half a step of the encoder, and positions of 24 bits on the bus.
    const double rounding_m = 0.5 * config.actuators[a].drive.scale.displacement_per_turn / 8192 + 1e-7;
    CHECK(rig.displacements().delta_a[a] == Approx(settings.start.delta_a[a]).margin(rounding_m));
    CHECK(rig.trace().back().command[a] == Approx(settings.start.delta_a[a]).margin(rounding_m));
  }
}

TEST_CASE("A request to stop disables every ODrive axis", "[scenario]") {
  const Config config = testing::with_odrive("finger");
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kRunning, kStartedWithin_s));
  rig.run_for(1);
  rig.requests().stop = true;
  REQUIRE(rig.run_until(Phase::kStopped, 1));
  CHECK_FALSE(rig.controller().latched().present);
  for (int a = 0; a < 2; ++a) CHECK(rig.drives().drive(a).power_stage() == hal::PowerStage::kOff);
  CHECK(testing::within_limits(config, rig.trace()));
}

TEST_CASE("A controller that dies leaves ODrive axes that stop by their watchdogs", "[scenario]") {
  const std::string firmware = GENERATE("0.5", "0.6");
  const Config config = testing::with_odrive("finger", firmware);
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kRunning, kStartedWithin_s));
  rig.run_for(0.8);
  rig.controller_plug().set_plugged(false);
  rig.stall_control(true);
  rig.run_for(testing::heartbeat_timeout_s(config) + 0.25);
  for (int a = 0; a < 2; ++a) CHECK(rig.drives().drive(a).power_stage() == hal::PowerStage::kFault);
  const PlantDisplacements held = rig.displacements();
  rig.run_for(0.5);
  CHECK(rig.displacements().delta_a == held.delta_a);
}

TEST_CASE("An ODrive axis' fault stops all axes, and the reason names it", "[scenario]") {
  const std::string firmware = GENERATE("0.5", "0.6");
  const Config config = testing::with_odrive("finger", firmware);
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kRunning, kStartedWithin_s));
  rig.run_for(0.8);
  rig.drives().drive(1).overheat();
  REQUIRE(rig.run_until(Phase::kStopped, 1.5));
  CHECK(rig.controller().latched().fault == rt::Fault::kDrives);
  CHECK_THAT(rig.master().describe(rig.controller().latched().drive),
             Contains("'left' (node 2)") && Contains("over-temperature"));
  rig.run_for(0.1);
  CHECK(rig.drives().drive(0).power_stage() == hal::PowerStage::kOff);
  CHECK(testing::within_limits(config, rig.trace()));
}

}  // namespace tendril::app::protocol_test
