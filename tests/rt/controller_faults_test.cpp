// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "rt/controller.h"
#include "tests/rt/one_cable.h"

namespace tendril::rt::controller_faults_test {

using testing::kMillisecond;
using testing::Rig;

TEST_CASE("A stale snapshot holds the lengths until a fresh one comes", "[unit]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  rig.step();
  rig.target.position[0] = 0.03;
  double held = 0;
  for (int k = 0; k < 60; ++k) {
    const Decision& decision = rig.step(false);
    const bool stale = k >= 50;
    CHECK(decision.faults.has(Fault::kSnapshotStale) == stale);
    if (k >= 51) CHECK(decision.command.displacement[0] == held);
    held = decision.command.displacement[0];
  }
  CHECK_FALSE(rig.step().faults.has(Fault::kSnapshotStale));
}

TEST_CASE("Snapshot and target age while the control thread oversleeps", "[unit]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  CHECK(rig.step().snapshot_age_ns == 0);
  rig.cycle.wakeup_ns = rig.config.target_age_limit_ns + 1;
  CHECK(rig.step().faults.has(Fault::kTargetStale));
  CHECK_FALSE(rig.step().faults.has(Fault::kSnapshotStale));
  rig.cycle.wakeup_ns = rig.config.snapshot_age_limit_ns + 1;
  CHECK(rig.step().snapshot_age_ns == rig.cycle.wakeup_ns);
  CHECK(rig.step().faults.has(Fault::kSnapshotStale));
}

TEST_CASE("A target that is stale, not finite or outside the workspace leaves the last good one", "[unit]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  CHECK(rig.step().desired[0] == 0.02);
  SECTION("stale") {
    rig.target.position[0] = 0.03;
    rig.target.stamp_ns = rig.cycle.now_ns - 20 * kMillisecond;
    const Decision& decision = rig.step(true, false);
    CHECK(decision.faults.has(Fault::kTargetStale));
    CHECK(decision.desired[0] == 0.02);
  }
  SECTION("not a number") {
    rig.target.position[0] = NAN;
    const Decision& decision = rig.step();
    CHECK(decision.faults.has(Fault::kTargetRefused));
    CHECK(decision.desired[0] == 0.02);
    CHECK(std::isfinite(decision.command.displacement[0]));
  }
  SECTION("outside") {
    rig.target.position[0] = 0.11;
    CHECK(rig.step().faults.has(Fault::kTargetRefused));
    rig.target.position[0] = 0.1;  // the border counts as inside
    CHECK_FALSE(rig.step().faults.has(Fault::kTargetRefused));
  }
  SECTION("of another size") {
    const bool both = GENERATE(true, false);
    if (both) rig.target.position.setZero(2);
    rig.target.velocity.setZero(2);
    CHECK(rig.step().faults.has(Fault::kTargetRefused));
  }
}

TEST_CASE("A QP that cannot be solved in time or at all holds the lengths", "[unit]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  const double held = rig.step().command.displacement[0];
  rig.target.position[0] = 0.03;
  SECTION("ill-posed: the snapshot's matrices are not numbers") {
    testing::fill_snapshot(*rig.snapshot, rig.cycle.now_ns);
    rig.snapshot->p_e_free[0] = NAN;
    const Decision& decision = rig.step(false);
    CHECK(decision.faults.has(Fault::kQpIllPosed));
    CHECK(decision.qp_solved);
    CHECK(decision.command.displacement[0] == Approx(held).margin(1e-3));
    CHECK(std::isfinite(decision.command.displacement[0]));
  }
  SECTION("capped") {
    ControllerConfig config = testing::one_cable();
    config.iteration_cap = 0;
    Rig capped(config);
    const double start = capped.step_until(Phase::kRunning).command.displacement[0];
    for (int k = 0; k < 10; ++k) CHECK(capped.step().command.displacement[0] == start);
    CHECK(capped.step().faults.has(Fault::kQpCapped));
  }
}

TEST_CASE("Late cycles stop the run only when there are too many in a row", "[unit]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  rig.cycle.late_in_a_row = rig.config.late_cycles_limit - 1;
  CHECK(rig.step().phase == Phase::kRunning);
  rig.cycle.late_in_a_row = rig.config.late_cycles_limit;
  CHECK(rig.step().phase == Phase::kStopping);
  CHECK(rig.controller.latched().present);
  CHECK(rig.controller.latched().fault == Fault::kLateCycles);
  rig.cycle.late_in_a_row = 0;
  CHECK(rig.step().phase >= Phase::kStopping);  // latched
}

TEST_CASE("A drive fault latches the reason and the fault of the drive", "[unit]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  rig.measurement.fault = {hal::FaultKind::kHeartbeatLost, 0, 0, 0};
  CHECK(rig.step().phase == Phase::kStopping);
  rig.measurement.fault = {hal::FaultKind::kBusOff, -1, 0, 0};  // what follows does not overwrite it
  rig.step();
  CHECK(rig.controller.latched().fault == Fault::kDrives);
  CHECK(rig.controller.latched().drive.kind == hal::FaultKind::kHeartbeatLost);
}

TEST_CASE("The loss of a required sensor stops the run, and which one it was is kept", "[unit]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  rig.measurement.sensors.lost = 3;
  const Decision lost = rig.step();
  CHECK(lost.phase == Phase::kStopping);
  CHECK(lost.faults.has(Fault::kSensorLost));
  rig.measurement.sensors.lost = -1;  // it is back: that comes too late
  rig.step_until(Phase::kStopped);
  CHECK(rig.controller.latched().present);
  CHECK(rig.controller.latched().fault == Fault::kSensorLost);
  CHECK(rig.controller.latched().lost_sensor == 3);
}

TEST_CASE("No drive is enabled before the required sensors are fresh", "[unit]") {
  Rig rig;
  rig.measurement.sensors.ready = false;
  for (int k = 0; k < 100; ++k) REQUIRE(rig.step().phase == Phase::kConnecting);
  rig.measurement.sensors.ready = true;
  CHECK(rig.step().phase == Phase::kModelling);
}

TEST_CASE("Drives that never disable do not keep the run from ending", "[unit]") {
  const int64_t limit_ns = GENERATE(1, 3) * int64_t{1'000'000'000};
  ControllerConfig config = testing::one_cable();
  config.disable_limit_ns = limit_ns;
  Rig rig(config);
  rig.step_until(Phase::kRunning);
  rig.cycle.stop_requested = true;
  int cycles = 0;  // of disabling
  for (Phase phase = Phase::kRunning; phase != Phase::kStopped; cycles += phase == Phase::kDisabling) {
    phase = rig.step().phase;
    rig.measurement.all_disabled = rig.measurement.finished = false;
    REQUIRE(cycles < 4000);
  }
  CHECK(std::abs(cycles - limit_ns / kMillisecond) <= 1);
}

TEST_CASE("What the bus did not take was not commanded: the robot goes on from the last command that it took",
          "[law]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  const double step = rig.config.v_max[0] * rig.config.period_s;
  const double start = rig.step().command.displacement[0];
  const double delivered = rig.step().command.displacement[0];
  REQUIRE(delivered == Approx(start + step));  // it moves
  REQUIRE(rig.step().command.displacement[0] == Approx(delivered + step));
  rig.cycle.undelivered = true;
  for (int k = 0; k < 1000; ++k) REQUIRE(rig.step().command.displacement[0] == Approx(delivered + step));
  rig.cycle.stop_requested = true;
  const Decision& last = rig.step();
  CHECK(last.phase == Phase::kDisabling);  // there is nothing to brake where nobody hears it
  CHECK(last.command.displacement[0] == Approx(delivered));
}

TEST_CASE("Drives that are not enabled yet hold what they measure, whether or not they hear it", "[unit]") {
  Rig rig;
  rig.cycle.undelivered = true;
  rig.measurement.displacement[0] = 0.007;
  while (rig.step().phase < Phase::kRunning) rig.measurement.displacement[0] = 0.007;
  CHECK(rig.step().command.displacement[0] ==
        Approx(0.007).margin(2 * rig.config.v_max[0] * rig.config.period_s));
}

TEST_CASE("The fault table has one line for every fault, in order", "[unit]") {
  for (int k = 0; k < kFaultKinds; ++k) {
    CHECK(static_cast<int>(kFaultTable[k].fault) == k);
    CHECK(std::string(kFaultTable[k].words).size() > 10);
  }
}

}  // namespace tendril::rt::controller_faults_test
