// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "tests/rt/one_cable.h"

// A robot whose drives have no torque for a while, after a fault or because an operator wants it so.

namespace tendril::rt::controller_standby_test {

using testing::kMillisecond;
using testing::Rig;

ControllerConfig waiting() {
  ControllerConfig config = testing::one_cable();
  config.waits_after_fault = true;
  return config;
}

/// Cycles until a phase, of which there may be earlier and later ones.
const Decision& go_to(Rig& rig, Phase phase, bool fresh_snapshot = true) {
  for (int k = 0; k < 5000; ++k)
    if (const Decision& decision = rig.step(fresh_snapshot); decision.phase == phase) return decision;
  FAIL("phase " << name(phase) << " was not reached");
  return rig.step();
}

/// A rig that a fault of its drive has stopped.
struct Stopped : Rig {
  Stopped() : Rig(waiting()) {
    go_to(*this, Phase::kRunning);
    for (int k = 0; k < 50; ++k) step();
    measurement.fault = {hal::FaultKind::kHeartbeatLost, 0, 0, 0};
    go_to(*this, Phase::kStandby);
  }
  /// As the drives' master does.
  const Decision& reset(bool fresh_target = true) {
    cycle.reset_requested = true;
    const Decision& decision = step(true, fresh_target);
    cycle.reset_requested = false;
    if (decision.command.reset) measurement.fault = {};
    return decision;
  }
};

TEST_CASE(
    "After a fault the drives lose their torque, are still served, and nothing but a reset changes that",
    "[unit]") {
  Stopped rig;
  for (int k = 0; k < 3000; ++k) {
    if (k == 100) rig.measurement.fault = {};  // the cause has gone
    const Decision& decision = rig.step();
    REQUIRE(decision.phase == Phase::kStandby);
    REQUIRE(decision.latched.present);
    REQUIRE_FALSE(decision.command.enable);
    REQUIRE_FALSE(decision.command.finish);
    REQUIRE_FALSE(decision.command.reset);
    REQUIRE_FALSE(decision.efforts_active);
  }
  CHECK(rig.controller.latched().drive.kind == hal::FaultKind::kHeartbeatLost);
  CHECK(rig.reset().command.reset);
  CHECK_FALSE(rig.step().command.reset);  // once
  CHECK_FALSE(rig.controller.latched().present);
  go_to(rig, Phase::kRunning);
}

TEST_CASE("A reset moves nothing, wherever the actuator was brought meanwhile and whatever was wanted before",
          "[law]") {
  Stopped rig;
  const double stands = GENERATE(-0.004, 0.0, 0.0113);
  rig.measurement.displacement[0] = stands;
  const int64_t old_target_ns = rig.target.stamp_ns;
  rig.reset(false);
  while (rig.step(true, false).phase != Phase::kRunning) {
    REQUIRE(rig.cycle.now_ns < 100'000 * kMillisecond);
    REQUIRE(rig.controller.latched().present == false);
  }
  REQUIRE(rig.target.stamp_ns == old_target_ns);
  for (int k = 0; k < 15; ++k)  // the old target would still be young enough
    CHECK(rig.step(true, false).command.displacement[0] == stands);
  rig.step();  // a new one is served
  CHECK(rig.step().command.displacement[0] != stands);
}

TEST_CASE("A reset waits for a snapshot of where the actuator stands now", "[unit]") {
  Stopped rig;
  rig.reset();
  go_to(rig, Phase::kModelling, false);
  for (int k = 0; k < 40; ++k) REQUIRE(rig.step(false).phase == Phase::kModelling);
  CHECK(rig.step(true).phase == Phase::kEnabling);
}

TEST_CASE("A fault that is still there after the reset stops the robot again", "[unit]") {
  Stopped rig;
  rig.reset();
  rig.measurement.fault = {hal::FaultKind::kBusOff, -1, 0, 0};
  go_to(rig, Phase::kStandby);
  CHECK(rig.controller.latched().present);
  CHECK(rig.controller.latched().drive.kind == hal::FaultKind::kBusOff);
}

TEST_CASE("An operator takes the torque away and gives it back, in any phase", "[unit]") {
  Rig rig(waiting());
  const Phase phase = GENERATE(Phase::kConnecting, Phase::kModelling, Phase::kEnabling, Phase::kRunning);
  rig.measurement.all_known = phase != Phase::kConnecting;
  if (phase == Phase::kConnecting)
    rig.step();
  else
    go_to(rig, phase);
  rig.cycle.standby_requested = true;
  go_to(rig, Phase::kStandby);
  for (int k = 0; k < 100; ++k) {
    const Decision& decision = rig.step();
    REQUIRE(decision.phase == Phase::kStandby);
    REQUIRE_FALSE(decision.command.enable);
  }
  rig.measurement.all_known = true;
  rig.cycle.standby_requested = false;
  go_to(rig, Phase::kRunning);
  CHECK_FALSE(rig.controller.latched().present);
}

TEST_CASE("A fault that comes while the drives have no torque is kept, and enabling needs a reset",
          "[unit]") {
  Rig rig(waiting());
  go_to(rig, Phase::kRunning);
  rig.cycle.standby_requested = true;
  go_to(rig, Phase::kStandby);
  rig.measurement.fault = {hal::FaultKind::kHeartbeatLost, 0, 0, 0};
  rig.step();
  CHECK(rig.controller.latched().present);
  rig.cycle.standby_requested = false;
  for (int k = 0; k < 100; ++k) REQUIRE(rig.step().phase == Phase::kStandby);
}

TEST_CASE("A run that waits ends when it is asked to, with the fault kept as the reason", "[unit]") {
  Stopped rig;
  rig.cycle.stop_requested = true;
  CHECK(rig.step().phase >= Phase::kDisabling);
  CHECK(go_to(rig, Phase::kStopped).command.finish);
  CHECK(rig.controller.latched().present);
}

TEST_CASE("Beside another controller no run waits, and without an operator none does", "[unit]") {
  const bool waits = GENERATE(true, false);
  ControllerConfig config = testing::one_cable();
  config.waits_after_fault = waits;
  Rig rig(config);
  go_to(rig, Phase::kRunning);
  rig.measurement.fault = {waits ? hal::FaultKind::kOtherMaster : hal::FaultKind::kHeartbeatLost, 0, 0, 0};
  for (Phase phase = Phase::kRunning; phase != Phase::kStopped;) {
    phase = rig.step().phase;
    REQUIRE(phase != Phase::kStandby);
  }
}

}  // namespace tendril::rt::controller_standby_test
