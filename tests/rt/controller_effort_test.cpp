// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "tests/rt/one_cable.h"

// Actuators that follow efforts: what their drives get is λ, from the instant at which they are enabled.

namespace tendril::rt::controller_effort_test {

using testing::kCompliance;
using testing::kCoupling;
using testing::kFree;
using testing::Rig;

ControllerConfig on_effort(StopAction stop = StopAction::kHold) {
  ControllerConfig config = testing::one_cable();
  config.follows_effort[0] = true;
  config.stop = stop;
  return config;
}

/// The effort at which the model of the rig has that displacement, N.
double effort_at(double displacement) { return (displacement - kFree) / kCompliance; }

TEST_CASE("An axis is commanded the effort of the QP's solution", "[law]") {
  Rig rig(on_effort());
  rig.step_until(Phase::kRunning);
  for (int k = 0; k < 100; ++k) rig.step();
  const Decision& decision = rig.step();
  CHECK(decision.command.effort[0] == Approx(0.02 / kCoupling));
  CHECK(decision.command.effort[0] == decision.lambda[0]);
  CHECK(decision.command.displacement[0] == Approx(kCompliance * decision.lambda[0] + kFree));
}

TEST_CASE("While drives are enabled the efforts are those at which the model rests, within their limits",
          "[unit]") {
  ControllerConfig config = on_effort();
  config.a_min[0] = GENERATE(0.0, 1.0);
  Rig rig(config);
  const double expected = std::max(config.a_min[0], -kFree / kCompliance);
  rig.measurement.all_known = false;
  CHECK(rig.controller.step(rig.measurement, nullptr, nullptr, rig.cycle).command.effort[0] ==
        config.a_min[0]);
  rig.measurement.all_known = true;
  const auto enabling = [&](double measured) -> const Decision& {
    rig.cycle.now_ns += testing::kMillisecond;
    testing::fill_snapshot(*rig.snapshot, rig.cycle.now_ns);
    rig.measurement.displacement[0] = measured;
    return rig.controller.step(rig.measurement, rig.snapshot.get(), nullptr, rig.cycle);
  };
  while (enabling(0).phase != Phase::kEnabling) REQUIRE(rig.cycle.now_ns < 2'000 * testing::kMillisecond);
  // The body is stiffer than the model, so that the axis moves; its command does not.
  for (const double measured : {0.0, -0.2e-3, -0.4e-3}) {
    const Decision& decision = enabling(measured);
    CHECK(decision.command.effort[0] == Approx(expected));
    CHECK(decision.command.displacement[0] == Approx(kCompliance * expected + kFree).margin(1e-12));
    CHECK(decision.efforts_active);  // the model stays with the efforts, too
  }
  rig.cycle.now_ns += testing::kMillisecond;
  testing::fill_snapshot(*rig.snapshot, rig.cycle.now_ns);
  rig.snapshot->lambda[0] = NAN;  // keeps the last
  CHECK(rig.controller.step(rig.measurement, rig.snapshot.get(), nullptr, rig.cycle).command.effort[0] ==
        Approx(expected));
  rig.measurement.all_enabled = true;
  const Decision& first = enabling(-0.4e-3);
  CHECK(first.phase == Phase::kRunning);
  CHECK(first.command.effort[0] == Approx(expected));
  CHECK(first.command.displacement[0] == Approx(kCompliance * expected + kFree).margin(1e-12));
}

TEST_CASE("Only the model of a robot that follows efforts is led by them before it runs", "[unit]") {
  for (const bool follows : {true, false}) {
    ControllerConfig config = on_effort();
    config.follows_effort[0] = follows;
    Rig rig(config);
    rig.measurement.all_known = true;
    for (Phase phase = Phase::kConnecting; phase <= Phase::kEnabling;) {
      const Decision& decision = rig.step();
      phase = decision.phase;
      CHECK(decision.efforts_active == (phase >= (follows ? Phase::kEnabling : Phase::kRunning)));
    }
  }
}

TEST_CASE("No effort moves faster than the top rate lets the model's actuator go", "[law]") {
  Rig rig(on_effort());
  double last = rig.step_until(Phase::kRunning).command.effort[0];
  const double most = rig.config.v_max[0] * rig.config.period_s / kCompliance;
  double largest = 0;
  for (int k = 0; k < 60; ++k) {
    rig.target.position[0] = k % 20 < 10 ? 0.03 : 0.0;  // jumps
    const double now = rig.step().command.effort[0];
    largest = std::max(largest, std::abs(now - last));
    last = now;
  }
  CHECK(largest == Approx(most));
}

TEST_CASE("A halt and a stop that holds leave the effort where it is", "[law]") {
  Rig rig(on_effort());
  rig.step_until(Phase::kRunning);
  for (int k = 0; k < 5; ++k) rig.step();
  const Decision moving = rig.step();
  REQUIRE(moving.command.effort[0] > effort_at(0) + 0.1);
  REQUIRE(moving.command.effort[0] < 0.02 / kCoupling - 0.1);
  SECTION("a halt") {
    testing::fill_snapshot(*rig.snapshot, rig.cycle.now_ns);
    rig.snapshot->p_e_free[0] = NAN;
    for (int k = 0; k < 20; ++k) {
      const Decision& decision = rig.step(false);
      CHECK(decision.faults.has(Fault::kQpIllPosed));
      CHECK(decision.command.effort[0] == moving.command.effort[0]);
      CHECK(decision.command.displacement[0] == moving.command.displacement[0]);
    }
    CHECK(rig.step().command.effort[0] > moving.command.effort[0]);  // and on it goes
  }
  SECTION("a stop") {
    rig.cycle.stop_requested = true;
    for (Phase phase = Phase::kStopping; phase < Phase::kStopped;) {
      const Decision& decision = rig.step();
      phase = decision.phase;
      CHECK(decision.command.effort[0] == moving.command.effort[0]);
    }
  }
}

TEST_CASE("A stop that relaxes lets the effort go at a steady pace to the one nearest to none", "[law]") {
  ControllerConfig config = on_effort(StopAction::kRelax);
  config.a_min[0] = GENERATE(-5.0, 0.0, 0.5);
  Rig rig(config);
  rig.target.position[0] = 0.03;
  rig.step_until(Phase::kRunning);
  for (int k = 0; k < 100; ++k) rig.step();
  double last = rig.step().command.effort[0];
  REQUIRE(last == Approx(3));
  const double rest = std::max(0.0, config.a_min[0]);
  // All of its range in the time that the displacement takes for its own, at a quarter of the top rate.
  const double pace = (config.a_max[0] - config.a_min[0]) / ((config.l_max[0] - config.l_min[0]) / 0.125);
  const double expected_s = (last - rest) / pace;
  rig.cycle.stop_requested = true;
  int cycles = 0;
  for (const Decision* d = &rig.step(); d->phase == Phase::kStopping; d = &rig.step(), ++cycles) {
    CHECK(d->command.enable);
    CHECK(last - d->command.effort[0] <= pace * testing::kPeriod_s * (1 + 1e-9));
    CHECK(d->command.effort[0] <= last);
    last = d->command.effort[0];
    REQUIRE(cycles < 2000);
  }
  CHECK(last == rest);
  CHECK(cycles * testing::kPeriod_s == Approx(expected_s).margin(2 * testing::kPeriod_s));
}

TEST_CASE("Whatever the model says, every effort is finite and within its limits, in every phase", "[law]") {
  const auto seed = GENERATE(range(1u, 6u));
  CAPTURE(seed);
  std::minstd_rand random(seed);
  const auto chance = [&](double share) {
    return std::uniform_real_distribution<double>(0, 1)(random) < share;
  };
  const auto any = [&] {
    return chance(0.1) ? NAN : chance(0.1) ? INFINITY : std::normal_distribution<double>(0, 10)(random);
  };
  ControllerConfig config = on_effort(chance(0.5) ? StopAction::kRelax : StopAction::kHold);
  config.a_min[0] = 0.5;
  Rig rig(config);
  int phases = 0;
  for (int k = 0; k < 600; ++k) {
    testing::fill_snapshot(*rig.snapshot, rig.cycle.now_ns + testing::kMillisecond);
    if (chance(0.5)) rig.snapshot->lambda[0] = any();
    if (chance(0.2)) rig.snapshot->delta_a_free[0] = any();
    if (chance(0.2)) rig.snapshot->p_e_free[0] = any();
    rig.target.position[0] = std::uniform_real_distribution<double>(-0.1, 0.1)(random);
    rig.cycle.stop_requested = k > 300;
    const Decision& decision = rig.step(false);
    phases |= 1 << static_cast<int>(decision.phase);
    REQUIRE(std::isfinite(decision.command.effort[0]));
    REQUIRE(decision.command.effort[0] >= config.a_min[0]);
    REQUIRE(decision.command.effort[0] <= config.a_max[0]);
  }
  CHECK((phases & 1 << static_cast<int>(Phase::kRunning)) != 0);
  CHECK((phases & 1 << static_cast<int>(Phase::kStopped)) != 0);
}

}  // namespace tendril::rt::controller_effort_test
