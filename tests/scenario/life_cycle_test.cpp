// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/scenario/robot_files.h"

// From power-on to disabled drives, in virtual time, on the finger.

namespace tendril::app::life_cycle_test {

using rt::Phase;

constexpr double kStartedWithin_s = 3.0;
constexpr double kStoppedWithin_s = 1.0;
constexpr double kOneCount_m = 1e-6;  // more than a count of the finger's encoders

TEST_CASE("Phases come in order and enabling moves nothing, wherever the winches stand", "[scenario]") {
  const Config config = testing::finger();
  VirtualSettings settings;
  settings.start.delta_a = {0.0021, -0.0007};  // as a controller that died may have left them
  VirtualRig rig(config, settings);
  REQUIRE(rig.run_until(Phase::kRunning, kStartedWithin_s));
  for (size_t k = 1; k < rig.trace().size(); ++k) CHECK(rig.trace()[k - 1].phase <= rig.trace()[k].phase);
  for (int a = 0; a < 2; ++a) {
    CHECK(rig.displacements().delta_a[a] == Approx(settings.start.delta_a[a]).margin(kOneCount_m));
    CHECK(rig.trace().back().command[a] == Approx(settings.start.delta_a[a]).margin(kOneCount_m));
  }
  // The model rests where the body does: the tip it believes in is the tip of the (stiffer) body, nearly.
  CHECK(rig.trace().back().p_e[0] == Approx(rig.measurements().back().tip.x()).margin(1e-3));
  rig.run_for(0.5);
  CHECK(testing::within_limits(config, rig.trace()));
}

TEST_CASE("A request to stop ramps the motion down, holds, and disables every drive", "[scenario]") {
  const Config config = testing::finger();
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kRunning, kStartedWithin_s));
  rig.run_for(1);
  rig.requests().stop = true;
  REQUIRE(rig.run_until(Phase::kStopped, kStoppedWithin_s));
  CHECK_FALSE(rig.controller().latched().present);
  rig.run_for(0.05);
  for (int a = 0; a < 2; ++a) CHECK(rig.drives().drive(a).power_stage() == hal::PowerStage::kOff);
  CHECK(testing::within_limits(config, rig.trace()));
}

TEST_CASE("A stop that relaxes ends with the cables at their rest lengths", "[scenario]") {
  Config config = testing::finger();
  config.control.stop = rt::StopAction::kRelax;
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kRunning, kStartedWithin_s));
  while (std::abs(rig.trace().back().command[0]) < 5e-4) rig.run_for(0.01);
  rig.requests().stop = true;
  REQUIRE(rig.run_until(Phase::kStopped, 3));
  for (int a = 0; a < 2; ++a) CHECK(std::abs(rig.displacements().delta_a[a]) < 1e-5);
  CHECK(testing::within_limits(config, rig.trace()));
}

TEST_CASE("A request to stop before the drives are enabled ends the run without moving them", "[scenario]") {
  const Config config = testing::finger();
  const Phase phase = GENERATE(Phase::kConnecting, Phase::kModelling);
  VirtualRig rig(config, {});
  rig.stall_model(true);
  REQUIRE(rig.run_until(phase, kStartedWithin_s));
  rig.requests().stop = true;
  REQUIRE(rig.run_until(Phase::kStopped, 3));
  CHECK_FALSE(rig.controller().latched().present);
  CHECK(rig.displacements().delta_a == PlantDisplacements{}.delta_a);
}

TEST_CASE("A controller that comes back after its death holds the measured lengths", "[scenario]") {
  const Config config = testing::finger();
  PlantDisplacements left;
  {
    VirtualRig first(config, {});
    REQUIRE(first.run_until(Phase::kRunning, kStartedWithin_s));
    first.run_for(0.7);
    left = first.displacements();
  }
  VirtualSettings settings;
  settings.start = left;
  VirtualRig second(config, settings);
  REQUIRE(second.run_until(Phase::kRunning, kStartedWithin_s));
  for (int a = 0; a < 2; ++a)
    CHECK(second.displacements().delta_a[a] == Approx(left.delta_a[a]).margin(kOneCount_m));
}

}  // namespace tendril::app::life_cycle_test
