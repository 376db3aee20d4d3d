// SPDX-License-Identifier: Apache-2.0
#include "app/operation/target_source.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

namespace tendril::app::target_source_test {

using rt::EffectorVector;
using Mode = TargetSource::Mode;

constexpr int64_t kStart_ns = 7'000'000'000;
constexpr int64_t kSecond_ns = 1'000'000'000;
constexpr double kSpeed = 0.02;     // m/s, of the path
constexpr double kAgeLimit = 0.5;   // s, of targets
constexpr double kRounding = 1e-9;  // m: times are whole nanoseconds

EffectorVector point(double x, double y, double z) {
  EffectorVector result(3);
  result << x, y, z;
  return result;
}

const EffectorVector kRest = point(0, 0, 0.1);
const EffectorVector kStill = EffectorVector::Zero(3);

/// A tip before a triangle of 30, 40 and 50 mm, or before nothing.
Config robot(bool path) {
  Config config;
  config.effectors = {{"tip", {}, {true, true, true}, {}, {1, 1, 1}}};
  if (path)
    config.motion = MotionConfig{{0, 0, 0.1}, {{0, 0, 0}, {0.03, 0, 0}, {0.03, 0.04, 0}}, kSpeed, true};
  config.control.target_age_limit = kAgeLimit;
  return config;
}

struct Source {
  explicit Source(bool path = true) : config(robot(path)), targets(config, kRest) {
    targets.begin({kStart_ns, kRest});
  }

  EffectorVector wanted(double s) const { return targets.wanted(at(s)); }
  static int64_t at(double s) { return kStart_ns + std::llround(1e9 * s); }

  Config config;
  TargetSource targets;
};

double distance(const EffectorVector& a, const EffectorVector& b) { return (a - b).norm(); }

TEST_CASE("Nothing is wanted of a robot without a path until somebody asks for something", "[unit]") {
  Source robot(false);
  CHECK(robot.targets.mode() == Mode::kNone);
  CHECK_FALSE(robot.targets.at(kStart_ns));
  CHECK(robot.wanted(1) == kRest);
  robot.targets.hold(Source::at(1));
  CHECK(robot.targets.mode() == Mode::kNone);
  robot.targets.aim(Source::at(2), point(0.01, 0, 0.1), kSecond_ns, kStill);
  CHECK(distance(robot.wanted(2), kRest) < kRounding);
  CHECK(distance(robot.wanted(2.5), point(0.005, 0, 0.1)) < kRounding);
}

TEST_CASE("A robot with a path follows it from the start, as its file says", "[unit]") {
  const Source robot;
  const Motion motion(robot.config, kRest, {kStart_ns, kRest});
  CHECK(robot.targets.mode() == Mode::kPath);
  REQUIRE(robot.targets.undisturbed_path());
  for (double s = 0; s < 8; s += 0.377) {
    const auto target = robot.targets.at(Source::at(s));
    REQUIRE(target);
    CHECK(distance(target->position, motion.at(Source::at(s)).position) == 0);
    CHECK(target->stamp_ns == Source::at(s));
    CHECK(target->until_ns == motion.at(Source::at(s)).until_ns);
  }
}

TEST_CASE("A target is reached when it should be, left with its velocity, and held after the age limit",
          "[law]") {
  Source robot;
  const EffectorVector from = robot.wanted(1), goal = point(-0.01, 0.02, 0.12), velocity = point(0.01, 0, 0);
  robot.targets.aim(Source::at(1), goal, 2 * kSecond_ns, velocity);
  CHECK_FALSE(robot.targets.undisturbed_path());
  CHECK(distance(robot.wanted(1), from) < kRounding);
  CHECK(distance(robot.wanted(2), 0.5 * (from + goal)) < kRounding);
  CHECK(distance(robot.wanted(3), goal) < kRounding);
  CHECK(distance(robot.wanted(3.2), goal + 0.2 * velocity) < kRounding);
  CHECK(distance(robot.wanted(3 + kAgeLimit), goal + kAgeLimit * velocity) < kRounding);
  CHECK(distance(robot.wanted(60), goal + kAgeLimit * velocity) < kRounding);
}

TEST_CASE("A stream of targets that come late or are lost moves on without a halt", "[law]") {
  const auto seed = std::random_device{}();
  INFO("seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  Source robot;
  robot.targets.aim(Source::at(0), kRest, 0, kStill);
  constexpr double kPeriod = 0.01, kStreamSpeed = 0.05;  // s, m/s
  constexpr int kCaughtUp = 100;                         // targets, after which the start is forgotten
  double sent_s = 0, last_x = 0, slowest = kStreamSpeed, fastest = 0;
  for (int k = 0; k < 400; ++k) {
    const double due_s = k * kPeriod;
    const double next_s = due_s + uniform(random) * 0.9 * kPeriod;  // late by less than a period
    for (double s = sent_s; s < next_s; s += 0.0005) {
      const double speed = robot.targets.at(Source::at(s))->velocity[0];
      if (k > kCaughtUp) slowest = std::min(slowest, speed), fastest = std::max(fastest, speed);
      CHECK(robot.wanted(s)[0] >= last_x - kRounding);
      last_x = robot.wanted(s)[0];
    }
    sent_s = next_s;
    if (k > kCaughtUp && uniform(random) < 0.1) continue;  // lost
    const EffectorVector goal = kRest + point(kStreamSpeed * (due_s + 2 * kPeriod), 0, 0);
    robot.targets.aim(Source::at(next_s), goal, std::llround(1e9 * (due_s + 2 * kPeriod - next_s)),
                      point(kStreamSpeed, 0, 0));
  }
  CHECK(slowest == Approx(kStreamSpeed).epsilon(1e-3));
  CHECK(fastest == Approx(kStreamSpeed).epsilon(1e-3));
}

TEST_CASE("On the path, time stands still in a pause and passes at the rate asked for", "[law]") {
  Source robot;
  const Motion motion(robot.config, kRest, {kStart_ns, kRest});
  const auto on_path = [&](double s) { return motion.at(Source::at(s)).position; };
  robot.targets.pause(Source::at(1));
  CHECK(robot.targets.mode() == Mode::kPaused);
  CHECK(distance(robot.wanted(5), on_path(1)) < kRounding);
  CHECK(robot.targets.at(Source::at(5))->velocity.isZero(0));
  robot.targets.set_path_rate(Source::at(5), 0.5);
  CHECK(distance(robot.wanted(6), on_path(1)) < kRounding);
  robot.targets.resume(Source::at(6));
  CHECK(distance(robot.wanted(8), on_path(2)) < kRounding);
  CHECK(robot.targets.at(Source::at(8))->velocity.norm() == Approx(0.5 * kSpeed));
  // The corner that the path has at 1.5 s is at 7 s of ours.
  CHECK(std::abs(robot.targets.at(Source::at(6.2))->until_ns - Source::at(7)) < 10);
}

TEST_CASE("Whatever is asked in whatever order, the target never jumps", "[law]") {
  const auto seed = std::random_device{}();
  INFO("seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  Source robot;
  int64_t now_ns = kStart_ns;
  for (int k = 0; k < 2000; ++k) {
    CAPTURE(k);
    now_ns += std::llround(1e9 * uniform(random));
    const EffectorVector before = robot.targets.wanted(now_ns);
    const auto what = static_cast<int>(7 * uniform(random));
    CAPTURE(what);
    if (what == 0)
      robot.targets.aim(now_ns, point(uniform(random), uniform(random), uniform(random)),
                        1 + std::llround(1e9 * uniform(random)), point(uniform(random), 0, 0));
    if (what == 1) robot.targets.hold(now_ns);
    if (what == 2) robot.targets.follow_path(now_ns);
    if (what == 3) robot.targets.pause(now_ns);
    if (what == 4) robot.targets.resume(now_ns);
    if (what == 5) robot.targets.set_path_rate(now_ns, uniform(random));
    REQUIRE(distance(robot.targets.wanted(now_ns), before) < kRounding);
    // What is sent now leads to what will be wanted, as long as it is valid.
    const rt::Target sent = *robot.targets.at(now_ns);
    const int64_t within_ns = std::llround(uniform(random) * static_cast<double>(sent.until_ns - now_ns));
    REQUIRE(distance(sent.at(now_ns + within_ns), robot.targets.wanted(now_ns + within_ns)) < kRounding);
  }
}

TEST_CASE("Within the limits of the file, whatever is asked, position, velocity and acceleration do not jump",
          "[law]") {
  const bool clock_changes = GENERATE(false, true);  // its ramps add to those of the path
  const auto seed = std::random_device{}();
  INFO("seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  constexpr double kAcceleration = 0.2, kJerk = 2;
  Config config = robot(true);
  config.motion->acceleration = kAcceleration;
  config.motion->jerk = kJerk;
  config.motion->corners = 0.002;
  TargetSource targets(config, kRest);
  targets.begin({kStart_ns, kRest});
  constexpr int64_t kStep_ns = 1'000'000;
  const double h = 1e-9 * static_cast<double>(kStep_ns);
  int64_t now_ns = kStart_ns;
  for (int k = 0; k < 300; ++k) {
    CAPTURE(k);
    const auto what = static_cast<int>((clock_changes ? 6 : 3) * uniform(random));
    CAPTURE(what);
    if (what == 0) targets.go(now_ns, 0.1 * point(uniform(random), uniform(random), uniform(random)), kSpeed);
    if (what == 1) targets.hold(now_ns);
    if (what == 2) targets.follow_path(now_ns);
    if (what == 3) targets.pause(now_ns);
    if (what == 4) targets.resume(now_ns);
    if (what == 5) targets.set_path_rate(now_ns, uniform(random));
    const double speed = kSpeed * (1 + 1e-6),
                 acceleration = (clock_changes ? 2 : 1) * kAcceleration * (1 + 1e-6);
    const double jerk = (clock_changes ? 5 : 1) * kJerk * (1 + 1e-6);
    const auto steps = static_cast<int>(800 * uniform(random));
    for (int step = 0; step < steps; ++step, now_ns += kStep_ns) {
      const rt::Target a = *targets.at(now_ns), b = *targets.at(now_ns + kStep_ns);
      REQUIRE(distance(b.position, a.position) / h <= speed);
      REQUIRE(distance(b.velocity, a.velocity) / h <= acceleration);
      REQUIRE(distance(b.acceleration, a.acceleration) / h <= jerk);
      const int64_t later_ns = std::min(a.until_ns, now_ns + 20'000'000);
      REQUIRE(distance(a.at(later_ns), targets.wanted(later_ns)) < jerk * std::pow(0.02, 3) / 6 + kRounding);
    }
  }
}

TEST_CASE("Within limits a target goes from rest to rest, and one that is on its way comes to rest first",
          "[unit]") {
  Config config = robot(true);
  config.motion->acceleration = 0.1;
  config.motion->jerk = 1;
  TargetSource targets(config, kRest);
  targets.begin({kStart_ns, kRest});
  targets.hold(Source::at(0));
  targets.go(Source::at(1), kRest + point(0.02, 0, 0), 0.02);  // 0.3 s to the speed: 1.3 s in all
  CHECK(distance(targets.wanted(Source::at(1.65)), kRest + point(0.01, 0, 0)) < kRounding);
  CHECK(targets.at(Source::at(1.65))->velocity[0] == Approx(0.02));
  CHECK(distance(targets.wanted(Source::at(2.3)), kRest + point(0.02, 0, 0)) < kRounding);
  targets.go(Source::at(3), kRest, 0.02);
  targets.go(Source::at(3.6), kRest + point(0.02, 0, 0), 0.02);  // back, at full speed
  CHECK(targets.at(Source::at(3.9))->velocity.norm() < 1e-9);    // 0.3 s to rest
  CHECK(targets.wanted(Source::at(3.9))[0] == Approx(0.02 - 0.009 - 0.003));
  CHECK(distance(targets.wanted(Source::at(6)), kRest + point(0.02, 0, 0)) < kRounding);
}

}  // namespace tendril::app::target_source_test
