#include "rt/controller.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "rt/heap_guard.h"
#include "tests/rt/one_cable.h"

namespace tendril::rt::controller_test {

using testing::kCompliance;
using testing::kCoupling;
using testing::kFree;
using testing::kMillisecond;
using testing::Rig;

TEST_CASE("The controller waits for positions, then for a model, then for the drives", "[unit]") {
  Rig rig;
  rig.measurement.all_known = false;
  rig.measurement.displacement[0] = 0.003;
  const auto step = [&](const Snapshot* snapshot) {
    rig.cycle.now_ns += kMillisecond;
    return rig.controller.step(rig.measurement, snapshot, nullptr, rig.cycle);
  };
  CHECK(step(nullptr).phase == Phase::kConnecting);
  rig.measurement.all_known = true;
  CHECK(step(nullptr).phase == Phase::kModelling);
  CHECK_FALSE(step(nullptr).command.enable);
  testing::fill_snapshot(*rig.snapshot, rig.cycle.now_ns);
  CHECK(step(rig.snapshot.get()).phase == Phase::kEnabling);
  CHECK(step(rig.snapshot.get()).command.enable);
  CHECK(step(rig.snapshot.get()).command.displacement[0] == 0.003);  // it holds where the drive is
  rig.measurement.all_enabled = true;
  rig.target.stamp_ns = rig.target.until_ns = rig.cycle.now_ns;
  const Decision first = rig.controller.step(rig.measurement, rig.snapshot.get(), &rig.target, rig.cycle);
  CHECK(first.phase == Phase::kRunning);
  CHECK(first.command.displacement[0] == 0.003);  // even though a target is there already
}

TEST_CASE("While running the effector goes to the target and the command is its length", "[law]") {
  Rig rig;
  const Decision& decision = rig.step_until(Phase::kRunning);
  for (int k = 0; k < 100; ++k) rig.step();
  CHECK(decision.p_e[0] == Approx(0.02).margin(1e-9));
  CHECK(decision.lambda[0] == Approx(0.02 / kCoupling));
  CHECK(decision.command.displacement[0] == Approx(kCompliance * 0.02 / kCoupling + kFree));
  CHECK(decision.faults.bits() == 0);
}

TEST_CASE("Goals that one cable cannot reach together are missed by the inverse squares of their weights",
          "[law]") {
  const Eigen::VectorXd weight = Eigen::Vector2d(1, 3), goal = Eigen::Vector2d(0.02, 0.03);
  ControllerConfig config = testing::one_cable();
  config.effector_coordinates = 2;
  config.workspace_min.setConstant(2, -0.1);
  config.workspace_max.setConstant(2, 0.1);
  Rig rig(config);
  rig.target.velocity.setZero(2);
  rig.target.position = goal;
  const auto step = [&] {
    testing::fill_snapshot(*rig.snapshot, rig.cycle.now_ns + kMillisecond);
    rig.snapshot->p_e_free.setZero(2);
    rig.snapshot->W_ea.setConstant(2, 1, kCoupling);
    rig.snapshot->D_W_ea = weight.cwiseAbs2().asDiagonal() * rig.snapshot->W_ea;
    const qp::Matrix H = rig.snapshot->W_ea.transpose() * rig.snapshot->D_W_ea;
    REQUIRE(rig.snapshot->problem.prepare(H, rig.snapshot->W_aa) == qp::Preparation::kReady);
    return rig.step(false);
  };
  for (int k = 0; k < 150; ++k) step();
  const Eigen::VectorXd miss = goal - step().p_e;
  CAPTURE(miss.transpose());
  CHECK(miss[0] == Approx(-0.009));
  CHECK(miss[1] == Approx(0.001));
}

/// The commands of a run with jumps of the target, a conflict of limits and a stop that relaxes, and the
/// faults in it, where displacements are counted in another unit: `unit` of it are a metre.
std::pair<std::vector<double>, std::vector<uint32_t>> run_in(double unit) {
  ControllerConfig config = testing::one_cable();
  config.stop = StopAction::kRelax;
  for (auto* v : {&config.l_min, &config.l_max, &config.v_max}) *v *= unit;
  for (auto* v : {&config.a_min, &config.a_max}) *v /= unit;
  Rig rig(config);
  rig.step_until(Phase::kModelling);
  std::pair<std::vector<double>, std::vector<uint32_t>> result;
  for (int k = 0; k < 400; ++k) {
    rig.cycle.now_ns += kMillisecond;
    testing::fill_snapshot(*rig.snapshot, rig.cycle.now_ns);
    Snapshot& s = *rig.snapshot;
    s.W_ea *= unit;
    s.D_W_ea *= unit;
    s.W_aa *= unit * unit;
    s.delta_a_free *= unit;
    s.lambda /= unit;
    if (k > 100 && k < 150) s.delta_a_free.setConstant(1, 0.0121 * unit);  // beyond the limit without effort
    REQUIRE(s.problem.prepare(s.W_ea.transpose() * s.W_ea, s.W_aa) == qp::Preparation::kReady);
    rig.target = testing::still(k % 60 < 30 ? 0.02 : 0.03, rig.cycle.now_ns);
    rig.cycle.stop_requested = k > 200;
    rig.cycle.now_ns -= kMillisecond;
    const Decision& decision = rig.step(false, false);
    result.first.push_back(decision.command.displacement[0] / unit);
    result.second.push_back(decision.faults.bits() << 8 | static_cast<uint32_t>(decision.phase));
  }
  return result;
}

TEST_CASE("The control law does not care in which unit displacements are counted", "[law]") {
  const auto metres = run_in(1);
  CHECK(std::count(metres.second.begin(), metres.second.end(), metres.second[120]) > 10);
  CHECK((metres.second[120] >> 8 & 1u << static_cast<int>(Fault::kQpSoftened)) != 0);
  CHECK((metres.second.back() & 0xFF) == static_cast<uint32_t>(Phase::kStopped));
  for (const double unit : {1e-6, 1e-3, 1e3}) {
    CAPTURE(unit);
    const auto other = run_in(unit);
    CHECK(other.second == metres.second);
    for (std::size_t k = 0; k < metres.first.size(); ++k)
      REQUIRE(other.first[k] == Approx(metres.first[k]).margin(1e-9));
  }
}

TEST_CASE("No cable ever moves faster than its top speed", "[law]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  double last = rig.measurement.displacement[0];
  const double reach = rig.config.v_max[0] * rig.config.period_s;
  bool at_speed = false;
  for (int k = 0; k < 50; ++k) {
    rig.target.position[0] = k % 17 < 8 ? 0.03 : 0.0;  // jumps
    const double now = rig.step().command.displacement[0];
    CHECK(std::abs(now - last) <= reach * (1 + 1e-12));
    at_speed = at_speed || std::abs(now - last) > 0.99 * reach;
    last = now;
  }
  CHECK(at_speed);
}

TEST_CASE("A target out of reach brings the cable to its limit and not beyond", "[law]") {
  Rig rig;
  rig.target.position[0] = 0.09;
  rig.step_until(Phase::kRunning);
  for (int k = 0; k < 100; ++k) rig.step();
  const Decision& decision = rig.step();
  CHECK(decision.command.displacement[0] == Approx(rig.config.l_max[0]));
  CHECK(decision.command.displacement[0] <= rig.config.l_max[0]);
  CHECK(decision.qp_status == qp::Status::kOptimal);
}

TEST_CASE("Effort limits win over strokes that conflict with them, and the fault is told", "[law]") {
  ControllerConfig config = testing::one_cable();
  config.a_min[0] = 4;  // pulls 15 mm, the stroke ends at 12 mm
  Rig rig(config);
  rig.step_until(Phase::kRunning);
  for (int k = 0; k < 100; ++k) rig.step();
  const Decision& decision = rig.step();
  CHECK(decision.faults.has(Fault::kQpSoftened));
  CHECK(decision.lambda[0] == Approx(4));
  CHECK(decision.command.displacement[0] ==
        Approx(rig.config.l_max[0]));  // and still no command beyond the stroke
}

TEST_CASE("An actuator outside its stroke is led back as far as its effort allows, and no further away",
          "[law]") {
  ControllerConfig config = testing::one_cable();
  config.l_min[0] = 0.008;  // 9/4 N; the cable stands at 0
  config.a_max[0] = GENERATE(1.5, 5.0);
  Rig rig(config);
  rig.target.position[0] = 0;
  double last = rig.step_until(Phase::kRunning).command.displacement[0];
  for (int k = 0; k < 100; ++k) {
    const double now = rig.step().command.displacement[0];
    CHECK(now >= last);
    last = now;
  }
  const bool strong = config.a_max[0] > 2.25;
  CHECK(last == Approx(strong ? 0.008 : kCompliance * config.a_max[0] + kFree));
  CHECK(rig.step().faults.has(Fault::kQpSoftened) == !strong);
}

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
  CHECK(rig.controller.faulted());
  CHECK(rig.controller.stop_reason() == Fault::kLateCycles);
  rig.cycle.late_in_a_row = 0;
  CHECK(rig.step().phase >= Phase::kStopping);  // latched
}

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
  CHECK_FALSE(rig.controller.faulted());
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

TEST_CASE("A drive fault latches the reason and the fault of the drive", "[unit]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  rig.measurement.fault = {hal::FaultKind::kHeartbeatLost, 0, 0, 0};
  CHECK(rig.step().phase == Phase::kStopping);
  rig.measurement.fault = {hal::FaultKind::kBusOff, -1, 0, 0};  // what follows does not overwrite it
  rig.step();
  CHECK(rig.controller.stop_reason() == Fault::kDrives);
  CHECK(rig.controller.drive_fault().kind == hal::FaultKind::kHeartbeatLost);
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
  CHECK(rig.controller.faulted());
  CHECK(rig.controller.stop_reason() == Fault::kSensorLost);
  CHECK(rig.controller.lost_sensor() == 3);
}

TEST_CASE("No drive is enabled before the required sensors are fresh", "[unit]") {
  Rig rig;
  rig.measurement.sensors.ready = false;
  for (int k = 0; k < 100; ++k) REQUIRE(rig.step().phase == Phase::kConnecting);
  rig.measurement.sensors.ready = true;
  CHECK(rig.step().phase == Phase::kModelling);
}

TEST_CASE("Drives that never disable do not keep the run from ending", "[unit]") {
  Rig rig;
  rig.step_until(Phase::kRunning);
  rig.cycle.stop_requested = true;
  int cycles = 0;
  for (Phase phase = Phase::kRunning; phase != Phase::kStopped; ++cycles) {
    phase = rig.step().phase;
    rig.measurement.all_disabled = rig.measurement.finished = false;
    REQUIRE(cycles < 2000);
  }
  CHECK(cycles > 500);
}

TEST_CASE("The fault table has one line for every fault, in order", "[unit]") {
  for (int k = 0; k < kFaultKinds; ++k) {
    CHECK(static_cast<int>(kFaultTable[k].fault) == k);
    CHECK(std::string(kFaultTable[k].words).size() > 10);
  }
}

TEST_CASE("A step of the largest robot makes no heap call in any phase", "[rt]") {
  if (!HeapGuard::available()) {
    WARN("skipped: heap calls cannot be counted under a sanitizer");
    return;
  }
  ControllerConfig config;
  const int m = config.actuators = kMaxActuators, e = config.effector_coordinates = kMaxEffectorCoordinates;
  config.a_min.setZero(m);
  config.a_max.setConstant(m, 5);
  config.l_min.setConstant(m, -0.02);
  config.l_max.setConstant(m, 0.02);
  config.v_max.setConstant(m, 0.5);
  config.workspace_min.setConstant(e, -1);
  config.workspace_max.setConstant(e, 1);
  config.period_s = testing::kPeriod_s;
  config.snapshot_age_limit_ns = config.target_age_limit_ns = 20 * kMillisecond;
  config.stop = GENERATE(StopAction::kHold, StopAction::kRelax);
  for (int a = 0; a < m; a += 2) config.follows_effort[a] = true;
  Controller controller(config);

  std::srand(5);
  const auto snapshot = std::make_unique<Snapshot>();
  snapshot->W_ea = 0.01 * CouplingMatrix::Random(e, m);
  snapshot->D_W_ea = snapshot->W_ea;
  const qp::Matrix root = qp::Matrix::Random(m, m);
  snapshot->W_aa = 1e-4 * (root * root.transpose() + qp::Matrix::Identity(m, m));
  snapshot->delta_a_free.setZero(m);
  snapshot->p_e_free.setZero(e);
  snapshot->lambda.setZero(m);
  const qp::Matrix H = snapshot->W_ea.transpose() * snapshot->W_ea + 1e-4 * snapshot->W_aa;
  REQUIRE(snapshot->problem.prepare(H, snapshot->W_aa) == qp::Preparation::kReady);
  Target target;
  target.velocity.setZero(e);
  hal::Measurement measurement;
  measurement.axes = m;
  measurement.all_known = measurement.all_enabled = true;

  CycleInput cycle;
  cycle.now_ns = kMillisecond;
  int phases = 0, iterations = 0;
  const HeapGuard heap;
  for (int k = 0; k < 2000; ++k) {
    cycle.now_ns += kMillisecond;
    cycle.stop_requested = k > 300;
    if (k < 200 || k > 260) snapshot->stamp_ns = cycle.now_ns;  // stale in between
    target.position.setConstant(e, k % 40 < 20 ? 0.02 : -0.03);
    if (k % 50 == 7) target.position[3] = NAN;
    target.stamp_ns = target.until_ns = cycle.now_ns;
    const Decision& decision = controller.step(measurement, snapshot.get(), &target, cycle);
    phases |= 1 << static_cast<int>(decision.phase);
    iterations = std::max(iterations, decision.qp_iterations);
    measurement.displacement = decision.command.displacement;
    measurement.finished = decision.command.finish;
  }
  CHECK(heap.calls() == 0);
  for (const Phase phase : {Phase::kRunning, Phase::kStopping, Phase::kDisabling, Phase::kStopped})
    CHECK((phases & 1 << static_cast<int>(phase)) != 0);
  CHECK(iterations > 1);
}

}  // namespace tendril::rt::controller_test
