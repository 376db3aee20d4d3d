// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/simulated_servo.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "tests/hal/heap_count.h"

namespace tendril::hal::simulated_servo_test {

constexpr int64_t kMillisecond_ns = 1'000'000;
constexpr int64_t kDay_ns = 86'400'000'000'000;
constexpr double kTick_s = 1e-9 * SimulatedServo::kTick_ns;

constexpr double kLargeOvershoot = 1e-3;  // of a step that meets the limits of speed and acceleration
constexpr double kSmallOvershoot = 1e-8;  // of a step that meets no limit: the ticks' share
constexpr double kPulseOvershoot = 0.14;  // of a step whose rate was fed forward: e⁻² and the ticks' share
constexpr double kStepError = 0.02;       // of a step, against theory, which knows no ticks

/// A servo of top speed 1 with power, at 0.
struct Bench {
  explicit Bench(const ServoTuning& tuning = {}) : servo(1, tuning, 0) {
    servo.advance(0);
    servo.unlock();
  }

  void advance(int64_t duration_ns) { servo.advance(now_ns += duration_ns); }

  /// Goes on tick by tick. @param watch  called after each
  void run(double seconds, const std::function<void()>& watch) {
    for (const int64_t end_ns = now_ns + std::llround(1e9 * seconds); now_ns < end_ns;) {
      advance(SimulatedServo::kTick_ns);
      watch();
    }
  }

  SimulatedServo servo;
  int64_t now_ns = 0;
};

TEST_CASE("A small step is followed as two equal poles do, without overshoot", "[law]") {
  const double gain = GENERATE(20.0, 100.0);
  Bench bench({.position_gain = gain});
  constexpr double kStep = 1e-4;
  bench.servo.pass_through(kStep, 0);
  double overshoot = 0, error = 0;
  bench.run(10 / gain, [&] {
    const double x = 2 * gain * 1e-9 * static_cast<double>(bench.now_ns);
    const double position = bench.servo.position() / kStep;
    overshoot = std::max(overshoot, position - 1);
    error = std::max(error, std::abs(position - (1 - (1 + x) * std::exp(-x))));
  });
  CHECK(overshoot < kSmallOvershoot);
  CHECK(error < kStepError);
  CHECK(bench.servo.position() == Approx(kStep).epsilon(1e-5));
}

TEST_CASE("A step of any size keeps to top speed and acceleration and arrives", "[law]") {
  const double gain = GENERATE(20.0, 100.0);
  const double step = GENERATE(1e-3, -0.02, 0.3, -1.0);
  const double limit = GENERATE(1.0, 0.4);
  CAPTURE(gain, step, limit);
  const ServoTuning tuning{.acceleration_time = 0.5 / gain, .position_gain = gain};
  Bench bench(tuning);
  bench.servo.limit_speed(limit);
  bench.servo.pass_through(step, 0);
  double velocity = 0, fastest = 0, hardest = 0, farthest = 0;
  bench.run(std::abs(step) / limit + 15 / gain, [&] {
    fastest = std::max(fastest, std::abs(bench.servo.velocity()));
    hardest = std::max(hardest, std::abs(bench.servo.velocity() - velocity) / kTick_s);
    farthest = std::max(farthest, bench.servo.position() / step);
    velocity = bench.servo.velocity();
  });
  CHECK(fastest <= limit * (1 + 1e-12));
  CHECK(hardest <= (1 + 1e-9) / tuning.acceleration_time);
  CHECK(farthest < 1 + kLargeOvershoot);
  CHECK(bench.servo.position() == Approx(step).epsilon(1e-5));
}

TEST_CASE("A ramp is followed at the distance of the rate that is not fed forward over the gain", "[law]") {
  const double gain = GENERATE(20.0, 100.0), fed_forward = GENERATE(0.0, 0.5, 1.0);
  constexpr double kRate = 0.3;
  CAPTURE(gain, fed_forward);
  Bench bench({.position_gain = gain});
  double lag = 0;
  bench.run(20 / gain, [&] {
    lag = kRate * 1e-9 * static_cast<double>(bench.now_ns) - bench.servo.position();
    bench.servo.pass_through(kRate * 1e-9 * static_cast<double>(bench.now_ns), fed_forward * kRate);
  });
  CHECK(lag == Approx((1 - fed_forward) * kRate / gain).margin(1e-9));
}

TEST_CASE("Set-points that are interpolated over their period are followed without lag", "[law]") {
  Bench bench;
  constexpr double kRate = 0.3;
  constexpr int64_t kPeriod_ns = 1'670'000;  // no whole number of ticks
  double goal = 0;
  for (int k = 0; k < 200; ++k) {
    bench.servo.interpolate(goal += kRate * 1e-9 * kPeriod_ns, kPeriod_ns);
    bench.advance(kPeriod_ns);
  }
  CHECK(bench.servo.velocity() == Approx(kRate).epsilon(1e-9));
  CHECK(bench.servo.following_error() >= -1e-12);  // what the set-point went since the last tick
  CHECK(bench.servo.following_error() < kRate * kTick_s);
}

TEST_CASE("A step over one interpolation period overshoots by what feeding its rate forward costs", "[law]") {
  const double step = GENERATE(1e-5, 1e-4, 1e-3, 1e-2, 0.1);
  CAPTURE(step);
  Bench bench;
  bench.servo.interpolate(step, 1'670'000);
  double farthest = 0;
  bench.run(1, [&] { farthest = std::max(farthest, bench.servo.position() / step); });
  CHECK(farthest < 1 + kPulseOvershoot);
  CHECK(bench.servo.position() == Approx(step));
}

TEST_CASE("A load within the force limit moves nothing, and costs acceleration only", "[law]") {
  const double sign = GENERATE(1.0, -1.0);
  Bench bench;
  bench.servo.set_load(0.999 * sign);
  bench.advance(1000 * kMillisecond_ns);
  CHECK(bench.servo.position() == 0);
  const auto seconds_to_half_speed = [sign](double load) {
    Bench loaded({.acceleration_time = 0.04});
    loaded.servo.set_load(load * sign);
    loaded.servo.pass_through(100 * sign, 0);
    while (std::abs(loaded.servo.velocity()) < 0.5) loaded.advance(SimulatedServo::kTick_ns);
    return 1e-9 * static_cast<double>(loaded.now_ns);
  };
  CHECK(seconds_to_half_speed(0) == Approx(0.02).epsilon(0.02));
  CHECK(seconds_to_half_speed(0.5) == Approx(0.04).epsilon(0.02));
  CHECK(seconds_to_half_speed(0.75) == Approx(0.08).epsilon(0.02));
}

TEST_CASE("A load beyond the force limit drags it backwards, at a speed that grows to top speed at twice it",
          "[law]") {
  const double sign = GENERATE(1.0, -1.0);
  const auto [load, speed] = GENERATE(table<double, double>({{1.1, 0.1}, {1.5, 0.5}, {2, 1}, {50, 1}}));
  CAPTURE(sign, load);
  Bench bench;
  bench.servo.set_load(sign * load);
  bench.advance(100 * kMillisecond_ns);
  CHECK(bench.servo.velocity() == Approx(-sign * speed));
  CHECK(bench.servo.following_error() * sign > 0);
  bench.servo.set_load(0);
  bench.advance(1000 * kMillisecond_ns);
  CHECK(bench.servo.position() == Approx(0).margin(1e-9));
}

TEST_CASE("Against a spring whose force is told only now and then it comes to rest at its force limit",
          "[law]") {
  const int64_t told_every_ns = GENERATE(1, 5, 20) * kMillisecond_ns;
  CAPTURE(told_every_ns);
  Bench bench;
  constexpr double kStiffness = 4;  // force limits a unit
  bench.servo.pass_through(1, 0);
  double last = 0;
  for (int k = 0; k < 200; ++k) {
    for (int64_t told_ns = 0; told_ns < 20 * kMillisecond_ns; told_ns += told_every_ns) {
      bench.servo.set_load(kStiffness * bench.servo.position());
      bench.advance(told_every_ns);
    }
    if (k > 100) CHECK(bench.servo.position() <= last + 1e-12);  // creeps back and does not chatter
    last = bench.servo.position();
  }
  CHECK(last == Approx(1 / kStiffness).epsilon(1e-3));
}

TEST_CASE(
    "An axis that pushes settles at the speed at which friction takes what the load leaves, within limits",
    "[law]") {
  struct Row {
    double friction, force, load, limit, speed;
  };
  const Row row =
      GENERATE(Row{1, 0.5, 0, 1, 0.5}, Row{1, 0.5, 0.3, 1, 0.2}, Row{1, -0.5, 0.3, 1, -0.8},
               Row{1, 0.4, 0.4, 1, 0}, Row{1, 3, 0.5, 1, 0.5}, Row{1, 0.5, 3, 1, -1},
               Row{1, 1, -0.5, 0.2, 0.2}, Row{1, -1, 0, 0.2, -0.2}, Row{1, 1, 1.2, 0.1, -0.2},
               Row{0.1, 0.35, 0.3, 1, 0.5}, Row{0.1, 0.25, 0.3, 1, -0.5}, Row{0.1, 0.5, 0, 1, 1},
               Row{0.1, 0.5, 0, 0.2, 0.2}, Row{0.1, -0.5, 0, 0.2, -0.2}, Row{0.1, 0.4, 0.4, 1, 0});
  CAPTURE(row.friction, row.force, row.load, row.limit);
  Bench bench({.friction = row.friction});
  bench.servo.set_load(row.load);
  bench.servo.limit_speed(row.limit);
  bench.servo.apply_force(row.force);
  bench.advance(500 * kMillisecond_ns);
  CHECK(bench.servo.velocity() == Approx(row.speed).margin(5e-3));
  CHECK(bench.servo.following_error() == 0);
  const double there = bench.servo.position();
  bench.servo.set_load(0);
  bench.servo.limit_speed(1);
  bench.servo.interpolate(there, kMillisecond_ns);
  bench.advance(1000 * kMillisecond_ns);
  CHECK(bench.servo.position() == Approx(there).margin(1e-9));
}

TEST_CASE("An axis that pushes runs up as its inertia and friction let it", "[law]") {
  constexpr double kFriction = 0.2, kForce = 0.1;
  Bench bench({.acceleration_time = 10e-3, .friction = kFriction});
  bench.servo.apply_force(kForce);
  double error = 0;
  bench.run(0.2, [&] {
    const double t = 1e-9 * static_cast<double>(bench.now_ns);
    const double v = kForce / kFriction * (1 - std::exp(-t * kFriction / 10e-3));
    error = std::max(error, std::abs(bench.servo.velocity() - v));
  });
  CHECK(error < 2e-3);
  CHECK(bench.servo.force() == Approx(kForce).epsilon(1e-3));
}

TEST_CASE("A servo tells what its motor exerts, whatever it does", "[law]") {
  Bench bench;
  bench.servo.set_load(0.3);
  bench.servo.apply_force(0.3);
  bench.advance(100 * kMillisecond_ns);
  CHECK(bench.servo.force() == Approx(0.3));
  bench.servo.set_jammed(true);
  bench.servo.apply_force(-0.7);
  bench.advance(10 * kMillisecond_ns);
  CHECK(bench.servo.force() == Approx(-0.7));
  bench.servo.set_jammed(false);
  bench.servo.pass_through(bench.servo.position(), 0);
  bench.advance(500 * kMillisecond_ns);
  CHECK(bench.servo.force() == Approx(0.3));  // it bears the load
  bench.servo.set_load(2);
  bench.advance(500 * kMillisecond_ns);
  CHECK(bench.servo.force() == 1);  // and no more than it can
  bench.servo.lock();
  CHECK(bench.servo.force() == 0);
}

TEST_CASE("Without power and where it is jammed an axis stands, whatever pulls at it", "[law]") {
  const bool jammed = GENERATE(false, true);
  Bench bench;
  bench.servo.pass_through(1, 0);
  bench.advance(300 * kMillisecond_ns);
  if (jammed)
    bench.servo.set_jammed(true);
  else
    bench.servo.lock();
  bench.servo.set_load(10);
  const double stood = bench.servo.position();
  bench.advance(1000 * kMillisecond_ns);
  CHECK(bench.servo.position() == stood);
  CHECK(bench.servo.velocity() == 0);
  CHECK(bench.servo.following_error() == (jammed ? 1 - stood : 0));
  bench.servo.set_load(0);
  bench.servo.set_jammed(false);
  bench.servo.unlock();
  bench.advance(2000 * kMillisecond_ns);
  CHECK(bench.servo.position() == Approx(jammed ? 1 : stood));
}

TEST_CASE("How time is cut into calls makes no difference to the bit", "[law]") {
  const auto run = [](const std::function<int64_t()>& cut) {
    Bench bench;
    std::minstd_rand random;
    for (int k = 1; k <= 50; ++k) {
      bench.servo.set_load(std::uniform_real_distribution<double>(-1.5, 1.5)(random));
      bench.servo.interpolate(std::uniform_real_distribution<double>(-0.1, 0.1)(random),
                              15 * kMillisecond_ns);
      for (const int64_t end_ns = k * 20 * kMillisecond_ns; bench.now_ns < end_ns;)
        bench.advance(std::min(cut(), end_ns - bench.now_ns));
    }
    return bench.servo;
  };
  std::minstd_rand random;
  const SimulatedServo whole = run([] { return 20 * kMillisecond_ns; });
  const SimulatedServo fine = run([] { return 10'000; });
  const SimulatedServo odd =
      run([&] { return std::uniform_int_distribution<int64_t>(1, 3'000'000)(random); });
  REQUIRE(whole.position() != 0);
  for (const SimulatedServo* other : {&fine, &odd}) {
    CHECK(other->position() == whole.position());
    CHECK(other->velocity() == whole.velocity());
  }
}

TEST_CASE("The hardest tuning is stable, and a day that is passed over ends at the goal", "[law]") {
  Bench bench({.acceleration_time = 1e-3, .position_gain = 1000});
  bench.servo.pass_through(0.5, 0);
  bench.servo.set_load(0.5);
  bench.advance(600 * kMillisecond_ns);
  CHECK(bench.servo.position() == Approx(0.5).margin(1e-9));
  bench.servo.pass_through(-0.5, 0);
  bench.advance(kDay_ns);
  CHECK(bench.servo.position() == Approx(-0.5).margin(1e-9));
  CHECK(bench.servo.velocity() == Approx(0).margin(1e-9));
}

#ifndef TENDRIL_SANITIZED
TEST_CASE("A servo makes no heap call", "[rt]") {
  Bench bench;
  const uint64_t before = test::heap_calls();
  for (int k = 0; k < 100; ++k) {
    bench.servo.interpolate(0.01 * k, kMillisecond_ns);
    bench.servo.set_load(0.02 * k);
    bench.advance(kMillisecond_ns);
  }
  bench.servo.lock();
  CHECK(test::heap_calls() == before);
}
#endif

}  // namespace tendril::hal::simulated_servo_test
