// SPDX-License-Identifier: Apache-2.0
#include "rt/disturbance_observer.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <deque>
#include <functional>
#include <random>

#include "tests/rt/one_cable.h"

// A cable moves one effector coordinate; a camera of 100 Hz sees it late. Where robot and model differ is
// known here.

namespace tendril::rt::disturbance_observer_test {

using testing::kCompliance;
using testing::kCoupling;
using testing::kFree;
using testing::kMillisecond;

constexpr double kSlope = kCoupling / kCompliance;  // m of the effector per m of cable
constexpr int64_t kFrame_ns = 10 * kMillisecond;

/// Where the model puts the effector at a displacement, m.
double modelled(double delta_a) { return kSlope * (delta_a - kFree); }

struct Bench {
  explicit Bench(int64_t age = 20 * kMillisecond) : age_ns(age) {
    testing::fill_snapshot(*snapshot, 0);
    measurement.axes = 1;
  }

  /// One cycle of 1 ms: the drive is at delta_a, the robot where `robot` says.
  double step(double delta_a) {
    now_ns += kMillisecond;
    measurement.stamp_ns = measurement.displacement_stamp_ns[0] = now_ns;
    measurement.displacement[0] = delta_a;
    if (now_ns % kFrame_ns == 0) exposed.push_back({now_ns, robot(delta_a)});
    while (!exposed.empty() && exposed.front().at_ns + age_ns <= now_ns) {
      measurement.sensors.stamp_ns[0] = exposed.front().at_ns;
      measurement.sensors.value[0] = exposed.front().y;
      exposed.pop_front();
    }
    if (spoil) spoil(measurement.sensors);
    // The effort that the controller believes in is the one that goes with another displacement, as drives
    // lag.
    lambda.setConstant(1, (delta_a + lag - kFree) / kCompliance);
    observer.step(measurement, lambda, *snapshot, now_ns);
    return observer.disturbance()[0];
  }
  double run(double seconds, double delta_a) {
    double d = 0;
    for (int k = 0; k < 1000 * seconds; ++k) d = step(delta_a);
    return d;
  }

  struct Exposure {
    int64_t at_ns;
    double y;
  };
  int64_t age_ns, now_ns = 1000 * kMillisecond;
  double lag = 0;  // m
  std::function<double(double)> robot = modelled;
  std::function<void(hal::SensorReadings&)> spoil;
  std::deque<Exposure> exposed;
  std::unique_ptr<Snapshot> snapshot = std::make_unique<Snapshot>();
  hal::Measurement measurement;
  ActuatorVector lambda;
  DisturbanceObserver observer{{{{0, 0, 0}}, 1e-3, 0.08, 0.03}, 1};
};

TEST_CASE(
    "A robot that is as its model needs no correction, however fast it moves, late its camera and lagging "
    "its drives",
    "[law]") {
  const int64_t age_ns = GENERATE(0, 20, 50, 120) * kMillisecond;
  Bench bench(age_ns);
  bench.lag = GENERATE(0.0, 0.002);
  for (int k = 0; k < 2000; ++k) {
    const double d = bench.step(0.02 * std::sin(5e-3 * k));  // up to 250 mm/s of the effector
    REQUIRE(std::abs(d) < 1e-9);
  }
}

TEST_CASE("A constant error of the model is found with the time constant, and kept", "[law]") {
  Bench bench;
  constexpr double kError = 0.004;
  bench.robot = [](double delta_a) { return modelled(delta_a) + kError; };
  bench.run(0.05, 0);  // three frames and their age
  const double begin = bench.run(0.02, 0);
  CHECK(bench.run(0.08, 0) - kError == Approx((begin - kError) * std::exp(-1.0)).epsilon(0.02));
  CHECK(bench.run(2, 0) == Approx(kError));
}

TEST_CASE("The loop is stable where the gains of robot and model differ by 40 %, for any age", "[law]") {
  const double gain = GENERATE(0.6, 1.0, 1.4);
  const int64_t age_ns = GENERATE(0, 20, 50, 200) * kMillisecond;
  CAPTURE(gain, age_ns);
  Bench bench(age_ns);
  bench.robot = [&](double delta_a) { return gain * modelled(delta_a) + 0.003; };
  constexpr double kWanted = 0.01;
  double d = 0;
  for (int k = 0; k < 8000; ++k) d = bench.step((kWanted - d) / kSlope + kFree);
  CHECK(bench.robot((kWanted - d) / kSlope + kFree) == Approx(kWanted).margin(1e-6));
}

TEST_CASE("One sample that is wrong moves nothing, and what is no sample counts for nothing", "[law]") {
  Bench bench;
  bench.robot = [](double delta_a) { return modelled(delta_a) + 0.002; };
  const double before = bench.run(2, 0);
  int when = 0;
  const std::string kind = GENERATE("jump", "not a number", "far away", "from the future", "from long ago");
  CAPTURE(kind);
  bench.spoil = [&](hal::SensorReadings& readings) {
    if (++when % 50 >= 10) return;  // a frame in five
    if (kind == "jump") readings.value[0] += 0.008;
    if (kind == "not a number") readings.value[0] = std::nan("");
    if (kind == "far away") readings.value[0] = 4;
    if (kind == "from the future") readings.stamp_ns[0] = bench.now_ns + 3'600'000 * kMillisecond;
    if (kind == "from long ago") readings.stamp_ns[0] = 5;
  };
  for (int k = 0; k < 2000; ++k) REQUIRE(std::abs(bench.step(0) - before) < 1e-6);
}

TEST_CASE("Without samples the correction is kept, then fades, and comes back; it never jumps", "[law]") {
  Bench bench;
  constexpr double kError = 0.004;
  bench.robot = [](double delta_a) { return modelled(delta_a) + kError; };
  double last = bench.run(2, 0);
  bench.robot = [](double) { return std::nan(""); };
  const auto pass = [&](double seconds) {
    for (int k = 0; k < 1000 * seconds; ++k) {
      const double d = bench.step(0);
      REQUIRE(std::abs(d - last) <= kError * 1e-3 / 0.08 * 1.01);
      last = d;
    }
    return last;
  };
  CHECK(pass(0.4) == Approx(kError).epsilon(1e-3));
  CHECK(pass(5) < 0.02 * kError);
  bench.robot = [](double delta_a) { return modelled(delta_a) + kError; };
  CHECK(pass(1) == Approx(kError).epsilon(1e-3));
}

TEST_CASE("A camera that shows one picture for ever is not believed while the model moves", "[law]") {
  Bench bench;
  bench.robot = [](double) { return modelled(0); };  // frozen at the start
  bench.run(0.5, 0);
  double largest = 0;
  for (int k = 0; k < 3000; ++k) largest = std::max(largest, std::abs(bench.step(1e-6 * k)));  // 2.5 mm/s
  CHECK(largest < 0.6e-3);  // until it was noticed
  bench.robot = [](double delta_a) { return modelled(delta_a) + 0.001; };
  CHECK(bench.run(1, 0.003) == Approx(0.001).epsilon(1e-3));
}

TEST_CASE("Noise of the camera reaches the correction smaller than it is", "[law]") {
  Bench bench;
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.05e-3);
  bench.robot = [&](double delta_a) { return modelled(delta_a) + noise(random); };
  double squares = 0;
  for (int k = 0; k < 20'000; ++k) squares += std::pow(bench.step(0), 2);
  CHECK(std::sqrt(squares / 20'000) < 0.4 * 0.05e-3);
}

}  // namespace tendril::rt::disturbance_observer_test
