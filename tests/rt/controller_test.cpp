// SPDX-License-Identifier: Apache-2.0
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