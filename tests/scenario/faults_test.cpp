// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/scenario/robot_files.h"

// What goes wrong around the controller, on all of Tendril in virtual time, on the finger: every row of the
// fault table. What drives can suffer is in plant_faults_test.cpp.

namespace tendril::app::faults_test {

using Catch::Matchers::Contains;
using rt::Fault;
using rt::Phase;

constexpr double kStoppedWithin_s = 1.0;   // from a fault to disabled drives
constexpr double kNoticedWithin_s = 0.25;  // a silent partner
constexpr double kEffortRounding_N = 1e-9;
constexpr double kBorder_m = 1e-9;  // the border of the workspace is inside, in spite of rounding

struct Running {
  Config config = testing::finger();
  VirtualRig rig{config, {}};
  Running() {
    REQUIRE(rig.run_until(Phase::kRunning, 3));
    rig.run_for(0.8);
    REQUIRE(rig.phase() == Phase::kRunning);
    REQUIRE(std::abs(speed()) > 1e-4);  // it moves
  }
  const rt::TraceRecord& last() const { return rig.trace().back(); }
  /// Commanded speed of the first cable, m/s.
  double speed() const {
    const auto& trace = rig.trace();
    return (trace.back().command[0] - trace[trace.size() - 2].command[0]) * config.control.rate_hz;
  }
  void check_limits() const { CHECK(testing::within_limits(config, rig.trace())); }
};

TEST_CASE("Without new snapshots the controller goes on for the age limit, then holds, then recovers",
          "[scenario]") {
  Running run;
  run.rig.stall_model(true);
  run.rig.run_for(0.5 * run.config.control.snapshot_age_limit);
  CHECK_FALSE(run.last().faults.has(Fault::kSnapshotStale));
  CHECK(std::abs(run.speed()) > 1e-4);
  run.rig.run_for(run.config.control.snapshot_age_limit);
  CHECK(run.last().faults.has(Fault::kSnapshotStale));
  const double held = run.last().command[0];
  run.rig.run_for(0.2);
  CHECK(run.last().command[0] == held);
  CHECK(run.last().phase == Phase::kRunning);
  run.rig.stall_model(false);
  run.rig.run_for(0.3);
  CHECK_FALSE(run.last().faults.has(Fault::kSnapshotStale));
  run.check_limits();
}

TEST_CASE("Without new targets the controller holds the last good one", "[scenario]") {
  Running run;
  run.rig.stall_targets(true);
  run.rig.run_for(run.config.control.target_age_limit + 0.1);
  REQUIRE(run.last().faults.has(Fault::kTargetStale));
  const double wanted = run.last().desired[0];
  run.rig.run_for(0.3);
  CHECK(run.last().desired[0] == wanted);
  CHECK(run.last().p_e[0] == Approx(wanted).margin(1e-4));
  run.rig.stall_targets(false);
  run.rig.run_for(0.1);
  CHECK(run.last().faults.bits() == 0);
  run.check_limits();
}

TEST_CASE("A target outside the workspace is refused and the last good one kept", "[scenario]") {
  Config config = testing::finger();
  config.control.workspace_max.x() = 0.003;  // the path goes to 5 mm
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kRunning, 3));
  rig.run_for(2);
  bool refused = false;
  for (const rt::TraceRecord& record : rig.trace()) {
    CHECK(record.desired[0] <= 0.003 + kBorder_m);
    refused = refused || record.faults.has(Fault::kTargetRefused);
  }
  CHECK(refused);
  CHECK(rig.phase() == Phase::kRunning);
  CHECK(testing::within_limits(config, rig.trace()));
}

TEST_CASE("Efforts win over strokes that they cannot reach, and the conflict is told", "[scenario]") {
  Config config = testing::finger();
  config.actuators[0].displacement_min = 0.004;  // which takes more tension than
  config.actuators[0].effort_max = 0.3;
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kRunning, 3));
  rig.run_for(1);
  int told = 0;
  for (const rt::TraceRecord& record : rig.trace()) {
    if (record.phase != Phase::kRunning || !record.qp_solved) continue;
    CHECK(record.lambda[0] <= 0.3 + kEffortRounding_N);
    told += record.faults.has(Fault::kQpSoftened);
  }
  CHECK(told > 0.5 * config.control.rate_hz);
  CHECK(rig.trace().back().command[0] < 0.004);
  CHECK(rig.phase() == Phase::kRunning);
}

TEST_CASE("A QP stopped at its cap brings the robot to a halt, and it goes on once one is solved",
          "[scenario]") {
  Config config = testing::finger();
  config.control.iteration_cap = 16;  // the least that is accepted; the first solve takes one more
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kRunning, 3));
  rig.run_for(6);
  int capped = 0, resumed = 0;
  const auto& trace = rig.trace();
  for (size_t k = 1; k < trace.size(); ++k) {
    const bool now = trace[k].faults.has(Fault::kQpCapped);
    capped += now;
    resumed += !now && trace[k - 1].faults.has(Fault::kQpCapped);
    if (now) CHECK(trace[k].lambda == trace[k - 1].lambda);  // never an iterate that is no solution
  }
  CAPTURE(capped, resumed);
  CHECK(capped > 0);
  CHECK(resumed > 0);
  CHECK(testing::within_limits(config, trace));
}

TEST_CASE("A model of what is no number halts the robot until it is one again", "[scenario]") {
  Running run;
  run.rig.spoil_snapshots(true);
  run.rig.run_for(0.3);
  REQUIRE(run.last().faults.has(Fault::kQpIllPosed));
  const double held = run.last().command[0];
  run.rig.run_for(0.2);
  CHECK(run.last().command[0] == held);
  CHECK(run.last().phase == Phase::kRunning);
  run.rig.spoil_snapshots(false);
  run.rig.run_for(0.3);
  CHECK(run.last().faults.bits() == 0);
  run.check_limits();
}

TEST_CASE("Late cycles in a row stop the robot, one fewer does not", "[scenario]") {
  Running run;
  const int limit = run.config.control.late_cycles_limit;
  run.rig.overrun_control(limit - 1);
  run.rig.run_for(0.3);
  CHECK(run.rig.phase() == Phase::kRunning);
  run.rig.overrun_control(limit);
  REQUIRE(run.rig.run_until(Phase::kStopped, kStoppedWithin_s));
  CHECK(run.rig.controller().latched().fault == Fault::kLateCycles);
  run.check_limits();
}

TEST_CASE("A controller that dies leaves drives that stop by themselves", "[scenario]") {
  Running run;
  run.rig.controller_plug().set_plugged(false);
  run.rig.stall_control(true);
  run.rig.run_for(testing::heartbeat_timeout_s(run.config) + kNoticedWithin_s);
  for (size_t a = 0; a < run.config.actuators.size(); ++a)
    CHECK(run.rig.drives().drive(static_cast<int>(a)).power_stage() == hal::PowerStage::kFault);
  const PlantDisplacements held = run.rig.displacements();
  run.rig.run_for(0.5);
  CHECK(run.rig.displacements().delta_a == held.delta_a);
}

TEST_CASE("A robot that vanishes from the bus makes the controller stop with the reason", "[scenario]") {
  Running run;
  run.rig.plant_plug().set_plugged(false);
  REQUIRE(run.rig.run_until(Phase::kStopping, testing::heartbeat_timeout_s(run.config) + kNoticedWithin_s));
  REQUIRE(run.rig.run_until(Phase::kStopped, 2 * kStoppedWithin_s));
  CHECK(run.rig.controller().latched().present);
  CHECK(run.rig.controller().latched().fault == Fault::kDrives);
  CHECK_THAT(run.rig.master().describe(run.rig.controller().latched().drive),
             Contains("right") && Contains("node 1") && Contains("lost"));
  run.check_limits();
  CHECK(run.rig.heap_calls() == 0);
}

TEST_CASE("A drive's fault stops all drives, and the reason names it", "[scenario]") {
  Running run;
  run.rig.drives().drive(1).overheat();
  REQUIRE(run.rig.run_until(Phase::kStopped, kStoppedWithin_s));
  CHECK(run.rig.controller().latched().fault == Fault::kDrives);
  const hal::DriveFault& fault = run.rig.controller().latched().drive;
  CHECK(fault.kind == hal::FaultKind::kDriveFault);
  CHECK(fault.axis == 1);
  CHECK_THAT(run.rig.master().describe(fault), Contains("left"));
  run.rig.run_for(0.1);
  CHECK(run.rig.drives().drive(0).power_stage() == hal::PowerStage::kOff);
  run.check_limits();
}

TEST_CASE("A bus that goes off ends the run with the reason", "[scenario]") {
  const auto [health, kind] = GENERATE(std::pair{hal::BusHealth::kOff, hal::FaultKind::kBusOff},
                                       std::pair{hal::BusHealth::kPassive, hal::FaultKind::kBusPassive},
                                       std::pair{hal::BusHealth::kDown, hal::FaultKind::kBusDown});
  Running run;
  run.rig.controller_plug().set_health(health);
  REQUIRE(run.rig.run_until(Phase::kStopped, 2 * kStoppedWithin_s));
  CHECK(run.rig.controller().latched().drive.kind == kind);
}

TEST_CASE("A model that gives up ends the run before any drive is enabled", "[scenario]") {
  Config config = testing::finger();
  VirtualRig rig(config, {});
  rig.stall_model(true);
  REQUIRE(rig.run_until(Phase::kModelling, 3));
  rig.requests().model_failed = true;
  REQUIRE(rig.run_until(Phase::kStopped, 3));
  CHECK(rig.controller().latched().fault == Fault::kModelFailed);
  for (const rt::TraceRecord& record : rig.trace()) CHECK(record.phase != Phase::kEnabling);
}

}  // namespace tendril::app::faults_test
