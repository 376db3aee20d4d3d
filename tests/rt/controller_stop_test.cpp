// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "rt/controller.h"
#include "tests/rt/one_cable.h"

namespace tendril::rt::controller_stop_test {

using testing::kMillisecond;
using testing::Rig;

TEST_CASE("A stop takes the speed out on a ramp before the drives are disabled", "[law]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  double last = rig.measurement.displacement[0];
  double speed = 0;
  for (int k = 0; k < 5; ++k) {
    rig.target.position[0] += 0.001;
    const double now = rig.step().command.displacement[0];
    speed = (now - last) / testing::kPeriod_s;
    last = now;
  }
  REQUIRE(speed > 0.1);
  rig.cycle.stop_requested = true;
  int ramp = 0;
  for (const Decision* d = &rig.step(); d->phase == Phase::kStopping; d = &rig.step(), ++ramp) {
    CHECK(d->command.enable);
    const double now = (d->command.displacement[0] - last) / testing::kPeriod_s;
    CHECK(now <= speed + 1e-9);
    CHECK(now >= -1e-9);
    speed = now;
    last = d->command.displacement[0];
    REQUIRE(ramp < 1000);
  }
  CHECK(ramp > 10);
  CHECK(rig.step().phase == Phase::kStopped);
  CHECK_FALSE(rig.step().command.enable);
  CHECK_FALSE(rig.controller.latched().present);
}

TEST_CASE("A stop that relaxes lets the cable out to its rest length and never beyond it", "[law]") {
  ControllerConfig config = testing::one_cable();
  config.stop = StopAction::kRelax;
  const auto [goal, lowest] =
      GENERATE(std::pair{0.02, -0.010}, std::pair{-0.015, -0.010}, std::pair{0.03, 0.002});
  config.l_min[0] = lowest;
  CAPTURE(goal, lowest);
  Rig rig(config);
  rig.measurement.displacement[0] = std::max(0.0, lowest);
  rig.target.position[0] = goal;
  rig.step_until(Phase::kRunning);
  for (int k = 0; k < 200; ++k) rig.step();
  const double rest = std::max(0.0, lowest);
  double distance = std::abs(rig.step().command.displacement[0] - rest);
  REQUIRE(distance > 5e-4);
  const double side = rig.measurement.displacement[0] - rest;
  rig.cycle.stop_requested = true;
  int cycles = 0;
  for (const Decision* d = &rig.step(); d->phase == Phase::kStopping; d = &rig.step()) {
    const double now = d->command.displacement[0] - rest;
    CHECK(now * side >= -1e-15);
    CHECK(std::abs(now) <= distance + 1e-15);
    distance = std::abs(now);
    REQUIRE(++cycles < 2000);
  }
  CHECK(distance < 1e-6);
}

TEST_CASE("A hold takes the speed out on a ramp too", "[law]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  double last = rig.measurement.displacement[0];
  for (int k = 0; k < 5; ++k) {
    rig.target.position[0] += 0.001;
    last = rig.step().command.displacement[0];
  }
  testing::fill_snapshot(*rig.snapshot, rig.cycle.now_ns);
  rig.snapshot->p_e_free[0] = NAN;  // every QP from here on is refused
  double speed = rig.config.v_max[0];
  int moving = 0;
  for (int k = 0; k < 40; ++k) {
    const double now = rig.step(false).command.displacement[0];
    CHECK((now - last) / testing::kPeriod_s <= speed + 1e-9);
    speed = (now - last) / testing::kPeriod_s;
    moving += speed > 1e-9;
    last = now;
  }
  CHECK(moving > 10);
}

TEST_CASE("Braking leads no cable beyond its limits, at either end", "[law]") {
  const double towards =
      GENERATE(0.0, 0.05);  // m, of the effector: as short and as long as efforts make the cable
  ControllerConfig config = testing::one_cable();
  config.l_min.setConstant(1, 0.002);
  for (const double away : {0.0003, 0.001, 0.003}) {
    CAPTURE(towards, away);
    Rig rig(config);
    rig.target = testing::still(0.02, 0);
    rig.step_until(Phase::kRunning);
    for (int k = 0; k < 100; ++k) rig.step();
    rig.target = testing::still(towards, 0);
    const double limit = towards > 0.02 ? config.l_max[0] : config.l_min[0];
    for (int k = 0; k < 100 && std::abs(rig.measurement.displacement[0] - limit) > away; ++k) rig.step();
    rig.cycle.stop_requested = true;
    int steps = 0;
    while (rig.step().phase == Phase::kStopping && ++steps < 1000) {
      CHECK(rig.measurement.displacement[0] >= config.l_min[0] - 1e-12);
      CHECK(rig.measurement.displacement[0] <= config.l_max[0] + 1e-12);
    }
    CHECK(std::abs(rig.measurement.displacement[0] - limit) <= away);  // it was on its way there
  }
}

}  // namespace tendril::rt::controller_stop_test
