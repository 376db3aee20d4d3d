// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cstring>

#include "app/robot/inverse_statics.h"
#include "tests/scenario/robot_files.h"

// How well the simulated robot follows a path, in virtual time. Its body is 10 % stiffer than the model and
// has a mass and damping of its own.

namespace tendril::app::path_test {

constexpr double kDiamondMean_mm = 1.0, kDiamondMax_mm = 2.0;  // the paper's robot: 1.82 mm on average
constexpr double kFingerMean_mm = 0.5, kFingerMax_mm = 1.0;
constexpr double kBenderMean_mm = 0.2, kBenderMax_mm = 0.6;
constexpr double kTrunkMean_mm = 0.25, kTrunkMax_mm = 0.7;
constexpr double kPlatformMean_mm = 0.1, kPlatformMax_mm = 0.2;

void check_run(const Config& config, const VirtualRig& rig, double mean_mm, double max_mm) {
  REQUIRE(rig.phase() == rt::Phase::kRunning);
  REQUIRE(rig.motion());
  REQUIRE(rig.now_ns() > rig.motion()->path_start_ns());
  int iterations = 0;
  for (const rt::TraceRecord& record : rig.trace()) {
    CHECK(record.faults.bits() == 0);
    iterations = std::max(iterations, record.qp_iterations);
  }
  CHECK(rig.heap_calls() == 0);
  CHECK(testing::within_limits(config, rig.trace()));
  const auto errors = testing::tracking_errors_mm(config, rig);
  CAPTURE(testing::mean(errors), testing::largest(errors), iterations);
  CHECK(testing::mean(errors) < mean_mm);
  CHECK(testing::largest(errors) < max_mm);
}

TEST_CASE("The diamond follows its square on a body that is stiffer than the model", "[scenario]") {
  const Config config = testing::diamond();
  VirtualRig rig(config, {.model_rate_hz = 30});
  rig.run_for(4.5);
  check_run(config, rig, kDiamondMean_mm, kDiamondMax_mm);
}

TEST_CASE("The finger follows its line with two cables for one coordinate", "[scenario]") {
  const Config config = testing::finger();
  VirtualRig rig(config, {});
  rig.run_for(4);
  check_run(config, rig, kFingerMean_mm, kFingerMax_mm);
}

TEST_CASE("The bender follows its line on what a pump puts into its chamber", "[scenario]") {
  const Config config = testing::shipped("bender");
  VirtualRig rig(config, {.model_rate_hz = 20});
  rig.run_for(2.6);
  check_run(config, rig, kBenderMean_mm, kBenderMax_mm);
  CHECK(rig.trace().back().lambda[0] > 5e3);  // Pa; it bends because the chamber is under pressure
}

TEST_CASE("The trunk follows its square with eight cables, and its middle gives way", "[scenario]") {
  const Config config = testing::shipped("trunk");
  VirtualRig rig(config, {.model_rate_hz = 20});
  rig.run_for(3);
  check_run(config, rig, kTrunkMean_mm, kTrunkMax_mm);
  const double tip = testing::largest_model_error(rig, 0), middle = testing::largest_model_error(rig, 3);
  CAPTURE(tip, middle);
  CHECK(tip < 0.1);
  CHECK(middle > tip);  // it weighs less
  CHECK(middle < 0.9);  // and is held all the same: with a weight of 0.001 it is 1.5 mm off
}

TEST_CASE("The platform points along its square with three rods and keeps its height", "[scenario]") {
  const Config config = testing::shipped("platform");
  VirtualRig rig(config, {.model_rate_hz = 20});
  rig.run_for(2.6);
  check_run(config, rig, kPlatformMean_mm, kPlatformMax_mm);
  CHECK(testing::largest_model_error(rig, 2) < 0.05);
}

TEST_CASE("The same run in virtual time gives the same bits", "[scenario]") {
  const Config config = testing::finger();
  VirtualRig one(config, {}), two(config, {});
  one.run_for(1.5);
  two.run_for(1.5);
  REQUIRE(one.phase() == rt::Phase::kRunning);
  REQUIRE(one.trace().size() == two.trace().size());
  REQUIRE(one.measurements().size() == two.measurements().size());
  const auto same_bits = [](const auto& a, const auto& b) { return std::memcmp(&a, &b, sizeof(a)) == 0; };
  for (size_t k = 0; k < one.trace().size(); ++k) {
    const rt::TraceRecord &a = one.trace()[k], &b = two.trace()[k];
    REQUIRE((same_bits(a.command, b.command) && same_bits(a.lambda, b.lambda) && same_bits(a.p_e, b.p_e) &&
             same_bits(a.measured, b.measured) && same_bits(a.desired, b.desired) &&
             same_bits(a.sensors.value, b.sensors.value)));
    REQUIRE((a.phase == b.phase && a.qp_iterations == b.qp_iterations &&
             a.snapshot_sequence == b.snapshot_sequence && a.faults.bits() == b.faults.bits() &&
             a.intended_ns == b.intended_ns));
  }
  for (size_t k = 0; k < one.measurements().size(); ++k)
    REQUIRE(same_bits(one.measurements()[k].tip, two.measurements()[k].tip));
}

TEST_CASE("A goal out of reach is served by the closest point, within all limits", "[scenario]") {
  Config config = testing::finger();
  config.control.workspace_min.x() = -0.2;
  config.control.workspace_max.x() = 0.2;
  config.motion->waypoints = {{0.08, 0, 0}};  // nearly the finger's length aside
  config.motion->speed = 0.05;
  VirtualRig rig(config, {});
  rig.run_for(5);
  REQUIRE(rig.phase() == rt::Phase::kRunning);
  CHECK(testing::within_limits(config, rig.trace()));
  const rt::TraceRecord& last = rig.trace().back();
  const StaticSolution best =
      solve_inverse_statics(*build_model(config), config, rt::EffectorVector::Constant(1, 0.08));
  REQUIRE(best.converged);
  CHECK(best.p_e[0] < 0.07);
  CHECK(last.p_e[0] == Approx(best.p_e[0]).margin(1e-4));
  // It got as far as its limits allow: something is at its limit.
  bool at_limit = false;
  for (size_t a = 0; a < config.actuators.size(); ++a)
    at_limit = at_limit || last.lambda[a] > config.actuators[a].effort_max - 1e-6 ||
               last.command[a] > config.actuators[a].displacement_max - 1e-6 ||
               last.command[a] < config.actuators[a].displacement_min + 1e-6;
  CHECK(at_limit);
}

TEST_CASE("The error grows when the model is refreshed less often and not when the bus is a little slower",
          "[figures]") {
  Config config = testing::finger();
  config.motion->speed = 0.04;
  const auto error = [&](const VirtualSettings& settings) {
    VirtualRig rig(config, settings);
    rig.run_for(3);
    REQUIRE(rig.phase() == rt::Phase::kRunning);
    return testing::mean(testing::tracking_errors_mm(config, rig));
  };
  const double fast = error({.model_rate_hz = 100});
  const double slow = error({.model_rate_hz = 2});
  const double slow_bus = error({.model_rate_hz = 100, .bus_delay_ns = 600'000});
  CAPTURE(fast, slow, slow_bus);
  CHECK(slow > 1.05 * fast);
  CHECK(slow_bus < 1.5 * fast);
}

}  // namespace tendril::app::path_test
