// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "hal/cia402/cia402_settings.h"
#include "tests/scenario/robot_files.h"

// Body and drives of the simulated robot on each other: the drives impose displacements, the body pulls back,
// and each is told of the other once in a time step of the body.

namespace tendril::app::servo_test {

using rt::Phase;

constexpr double kAtRest_m = 1e-7;     // a cable's way in a tenth of a second
constexpr double kLoadError = 1e-3;    // of the force limit
constexpr double kLagging_m = 2e-4;    // a drive that can hardly follow
constexpr uint32_t kStrayed = 0x8611;  // EMCY: following error
constexpr double kStoppedWithin_s = 2.0;

/// The finger goes 5 mm aside, where its right cable pulls with 0.55 N, and stays there.
Config finger_aside(double force_limit_N) {
  Config config = testing::finger();
  config.motion->waypoints = {{0.005, 0, 0}};
  config.motion->speed = 0.02;
  config.plant->drives.force_limit = force_limit_N / config.actuators[0].effort_max;
  return config;
}

/// The same robot, which goes on however far its axes are dragged from their commands.
Config that_goes_on(Config config) {
  for (ActuatorConfig& actuator : config.actuators) actuator.drive.following_error = 1;
  return config;
}

/// The least and the greatest of what is asked for every millisecond for a tenth of a second.
template <class Ask>
std::pair<double, double> range_of(VirtualRig& rig, const Ask& ask) {
  std::pair<double, double> range(1e9, -1e9);
  for (int k = 0; k < 100; ++k) {
    rig.run_for(1e-3);
    range = {std::min(range.first, ask()), std::max(range.second, ask())};
  }
  return range;
}

TEST_CASE("A drive gives way to more than it holds, and comes to rest where it holds it", "[scenario]") {
  const double time_step = GENERATE(1e-3, 5e-3, 20e-3);
  const bool reversed = GENERATE(false, true);
  CAPTURE(time_step, reversed);
  constexpr double kLimit_N = 0.4;
  Config config = that_goes_on(finger_aside(kLimit_N));
  config.plant->time_step = time_step;
  config.actuators[0].drive.scale.reversed = reversed;
  VirtualRig rig(config, {});
  rig.run_for(2.4);
  REQUIRE(rig.phase() == Phase::kRunning);
  const auto [least, greatest] = range_of(rig, [&] { return rig.displacements().delta_a[0]; });
  CHECK(greatest < rig.trace().back().command[0] - kLagging_m);
  CHECK(greatest - least < kAtRest_m);
  CHECK(rig.efforts().lambda_a[0] == Approx(kLimit_N).epsilon(kLoadError));
}

TEST_CASE("Rods that push and pull are held with no more than their drives' force", "[scenario]") {
  Config config = that_goes_on(testing::shipped("platform"));
  config.motion->waypoints = {config.motion->waypoints[0]};
  config.plant->drives.force_limit = 0.2;
  VirtualRig rig(config, {.model_rate_hz = 20});
  rig.run_for(3);
  REQUIRE(rig.phase() == Phase::kRunning);
  bool at_limit = false;
  for (size_t a = 0; a < config.actuators.size(); ++a) {
    const double limit = 0.2 * config.actuators[a].effort_max;
    const auto [least, greatest] = range_of(rig, [&] { return rig.efforts().lambda_a[a]; });
    CHECK(greatest < limit * (1 + kLoadError));
    CHECK(least > -limit * (1 + kLoadError));
    at_limit = at_limit || std::max(greatest, -least) > limit * (1 - kLoadError);
  }
  CHECK(at_limit);
}

TEST_CASE("A load below the force limit leaves a drive where it is commanded", "[scenario]") {
  const Config config = finger_aside(0.6);
  VirtualRig rig(config, {});
  rig.run_for(2.5);
  CHECK(rig.efforts().lambda_a[0] > 0.5);
  CHECK(rig.displacements().delta_a[0] == Approx(rig.trace().back().command[0]).margin(2e-6));
}

TEST_CASE("A drive that is dragged out of its following-error window stops the robot with that reason",
          "[scenario]") {
  Config config = finger_aside(0.4);
  hal::settings_as<hal::Cia402SimulationSettings>(config.plant->drives.protocol_settings).following_error =
      0.03;  // of 9 mm
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kStopped, 3 + kStoppedWithin_s));
  CHECK(rig.controller().latched().fault == rt::Fault::kDrives);
  CHECK(rig.controller().latched().drive.axis == 0);
  CHECK(rig.controller().latched().drive.code == kStrayed);
  CHECK(testing::within_limits(config, rig.trace()));
}

TEST_CASE("A cable that is cut no longer drags its drive", "[scenario]") {
  const Config config = that_goes_on(finger_aside(0.4));
  VirtualRig rig(config, {});
  rig.run_for(2.5);
  REQUIRE(rig.displacements().delta_a[0] < rig.trace().back().command[0] - kLagging_m);
  rig.drives().inject({.kind = PlantFaultKind::kCut, .axis = 0});
  rig.run_for(0.5);
  CHECK(rig.displacements().delta_a[0] == Approx(rig.trace().back().command[0]).margin(2e-6));
}

}  // namespace tendril::app::servo_test
