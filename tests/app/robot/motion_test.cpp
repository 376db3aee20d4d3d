// SPDX-License-Identifier: Apache-2.0
#include "app/robot/motion.h"

#include <catch2/catch.hpp>
#include <cmath>

namespace tendril::app::motion_test {

using rt::EffectorVector;

constexpr double kSpeed = 0.02;  // m/s
constexpr int64_t kStart_ns = 7'000'000'000;
constexpr int64_t kSecond_ns = 1'000'000'000;
constexpr int64_t kStep_ns = 1'234'567;  // of samples, so that none falls on a corner by chance
constexpr double kRounding = 1e-10;      // m: durations are whole nanoseconds

/// A tip in all three coordinates and a second effector in one, before a triangle of 30, 40 and 50 mm.
Config triangle(bool closed) {
  Config config;
  config.effectors = {{"tip", {}, {true, true, true}, {}, {1, 1, 1}},
                      {"knee", {}, {false, true, false}, {}, {1}}};
  config.motion = MotionConfig{{0, 0, 0.1}, {{0, 0, 0}, {0.03, 0, 0}, {0.03, 0.04, 0}}, kSpeed, closed};
  return config;
}

EffectorVector vector(std::initializer_list<double> values) {
  EffectorVector result(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), result.data());
  return result;
}

const EffectorVector kRest = vector({0, 0.006, 0.108, -0.05});  // 10 mm from the first waypoint
constexpr int64_t kApproach_ns = kSecond_ns / 2;

double distance(const EffectorVector& a, const EffectorVector& b) { return (a - b).norm(); }

TEST_CASE("The approach leads from where the effectors are to the first waypoint at the path's speed",
          "[unit]") {
  const Motion motion(triangle(true), kRest, {kStart_ns, kRest});
  CHECK(motion.path_start_ns() == kStart_ns + kApproach_ns);
  CHECK(distance(motion.at(kStart_ns).position, kRest) < kRounding);
  const EffectorVector half = vector({0, 0.003, 0.104, -0.05});
  CHECK(distance(motion.at(kStart_ns + kApproach_ns / 2).position, half) < kRounding);
  CHECK(distance(motion.at(motion.path_start_ns()).position, vector({0, 0, 0.1, -0.05})) < kRounding);
}

TEST_CASE("A path passes its waypoints at the instants that its speed gives", "[unit]") {
  const bool closed = GENERATE(true, false);
  const Motion motion(triangle(closed), kRest, {kStart_ns, kRest});
  const auto at_s = [&](double seconds) {
    return motion.at(motion.path_start_ns() + std::llround(1e9 * seconds)).position;
  };
  CHECK(distance(at_s(1.5), vector({0.03, 0, 0.1, -0.05})) < kRounding);
  CHECK(distance(at_s(3.5), vector({0.03, 0.04, 0.1, -0.05})) < kRounding);
  CHECK(distance(at_s(2.5), vector({0.03, 0.02, 0.1, -0.05})) < kRounding);
}

TEST_CASE("A path moves at constant speed without a jump, also over corners and from round to round",
          "[unit]") {
  const Motion motion(triangle(true), kRest, {kStart_ns, kRest});
  const double stride = kSpeed * 1e-9 * static_cast<double>(kStep_ns);
  double longest = 0, slowest = kSpeed, fastest = kSpeed;
  for (int64_t t = kStart_ns; t < kStart_ns + 14 * kSecond_ns; t += kStep_ns) {
    const rt::Target target = motion.at(t);
    longest = std::max(longest, distance(motion.at(t + kStep_ns).position, target.position));
    slowest = std::min(slowest, target.velocity.norm());
    fastest = std::max(fastest, target.velocity.norm());
  }
  CHECK(longest < stride * (1 + 1e-6));
  CHECK(slowest == Approx(kSpeed).epsilon(1e-8));
  CHECK(fastest == Approx(kSpeed).epsilon(1e-8));
}

TEST_CASE("A closed path goes round for ever", "[unit]") {
  const Motion motion(triangle(true), kRest, {kStart_ns, kRest});
  constexpr int64_t kRound_ns = 6 * kSecond_ns;
  for (const double share : {0.0, 0.1, 0.4, 0.7, 0.99}) {
    const int64_t t = motion.path_start_ns() + std::llround(share * static_cast<double>(kRound_ns));
    CHECK(distance(motion.at(t).position, motion.at(t + 1000 * kRound_ns).position) < kRounding);
  }
  const EffectorVector home_stretch = vector({0.015, 0.02, 0.1, -0.05});
  CHECK(distance(motion.at(motion.path_start_ns() + 4'750'000'000).position, home_stretch) < kRounding);
}

TEST_CASE("An open path ends at its last waypoint and stays", "[unit]") {
  const Motion motion(triangle(false), kRest, {kStart_ns, kRest});
  const EffectorVector end = vector({0.03, 0.04, 0.1, -0.05});
  for (const int64_t later_ns : {int64_t{0}, kSecond_ns, 1000 * kSecond_ns}) {
    const rt::Target target = motion.at(motion.path_start_ns() + 3'500'000'000 + later_ns);
    CHECK(distance(target.position, end) < kRounding);
    CHECK(distance(target.at(target.stamp_ns + kSecond_ns), end) < kRounding);
  }
}

TEST_CASE("A path of one waypoint ends there, open or closed", "[unit]") {
  Config config = triangle(GENERATE(true, false));
  config.motion->waypoints.resize(1);
  const Motion motion(config, kRest, {kStart_ns, kRest});
  for (const int64_t later_ns : {int64_t{0}, kStep_ns, 100 * kSecond_ns}) {
    const rt::Target target = motion.at(motion.path_start_ns() + later_ns);
    CHECK(distance(target.at(target.stamp_ns + kSecond_ns), vector({0, 0, 0.1, -0.05})) < kRounding);
  }
}

TEST_CASE("A target runs on to the end of its leg and never past it, however late the next one comes",
          "[unit]") {
  const bool closed = GENERATE(true, false);
  const Motion motion(triangle(closed), kRest, {kStart_ns, kRest});
  for (int64_t t = kStart_ns; t < kStart_ns + 10 * kSecond_ns; t += 97 * kStep_ns) {
    const rt::Target target = motion.at(t);
    CAPTURE(closed, t - kStart_ns);
    REQUIRE(target.stamp_ns == t);
    REQUIRE(target.until_ns >= t);
    const EffectorVector leg_end = motion.at(target.until_ns).position;
    for (const int64_t later_ns : {kStep_ns, kSecond_ns / 2, 5 * kSecond_ns}) {
      const EffectorVector served = target.at(t + later_ns);
      if (t + later_ns <= target.until_ns)
        CHECK(distance(served, motion.at(t + later_ns).position) < kRounding);
      else
        CHECK(distance(served, leg_end) < kRounding);
    }
  }
}

TEST_CASE("Coordinates of other effectors go to rest on the approach and stay there", "[unit]") {
  EffectorVector rest = kRest;
  rest[3] = -0.05 + 0.008;
  EffectorVector start = kRest;
  start[1] = 0;
  start[2] = 0.106;  // 6 mm from the first waypoint, and 8 mm aside with the other effector
  const Motion motion(triangle(true), rest, {kStart_ns, start});
  CHECK(motion.path_start_ns() == kStart_ns + kApproach_ns);  // 10 mm in all
  CHECK(motion.at(kStart_ns + kApproach_ns / 2).position[3] == Approx(-0.046));
  for (int64_t t = motion.path_start_ns(); t < kStart_ns + 8 * kSecond_ns; t += 97 * kStep_ns)
    CHECK(motion.at(t).position[3] == rest[3]);
}

TEST_CASE("The volume of a cavity goes to rest with the approach and does not count in its length",
          "[unit]") {
  Config config = triangle(true);
  config.effectors[1] = {"air", {}, {}, RegionConfig{}, {1000}};
  EffectorVector rest = kRest;
  rest[3] = 20e-6;
  EffectorVector start = kRest;
  start[3] = 5.0;  // m³
  const Motion motion(config, rest, {kStart_ns, start});
  CHECK(motion.path_start_ns() == kStart_ns + kApproach_ns);
  CHECK(motion.at(motion.path_start_ns()).position[3] == 20e-6);
}

TEST_CASE("The effector that the motion names follows the waypoints, the first one rests", "[unit]") {
  Config config = triangle(false);
  config.effectors = {{"tip", {}, {true, false, false}, {}, {1}},
                      {"knee", {}, {true, true, true}, {}, {1, 1, 1}}};
  config.motion->effector = 1;
  const Motion motion(config, kRest, {kStart_ns, kRest});
  const EffectorVector end = motion.at(kStart_ns + 100 * kSecond_ns).position;
  CHECK(distance(end, vector({kRest[0], 0.03, 0.04, 0.1})) < kRounding);
}

TEST_CASE("Only the controlled coordinates of a waypoint count", "[unit]") {
  Config config = triangle(false);
  config.effectors = {{"tip", {}, {true, false, true}, {}, {1, 1}}};
  const Motion motion(config, vector({0, 0.1}), {kStart_ns, vector({0, 0.1})});
  CHECK(motion.path_start_ns() == kStart_ns);
  const EffectorVector end = motion.at(kStart_ns + 100 * kSecond_ns).position;
  CHECK(distance(end, vector({0.03, 0.1})) < kRounding);
  CHECK(distance(motion.at(kStart_ns + kSecond_ns).position, vector({0.02, 0.1})) < kRounding);
}

/// The triangle with limits of acceleration and jerk: 0.1 s and 0.2 s after a stop the speed is reached.
Config limited(bool closed, double corners) {
  Config config = triangle(closed);
  config.motion->acceleration = 0.2;
  config.motion->jerk = 2;
  config.motion->corners = corners;
  return config;
}

TEST_CASE(
    "Within limits a path keeps to them from the approach to its second round, and its targets run on along "
    "it",
    "[law]") {
  const double corners = GENERATE(0.0, 0.002);
  const Motion motion(limited(true, corners), kRest, {kStart_ns, kRest});
  const double h = 1e-9 * static_cast<double>(kStep_ns);
  double speed = 0, jump = 0, bend = 0, jerk = 0, astray = 0;
  for (int64_t t = kStart_ns; t < motion.path_start_ns() + 2 * motion.round_ns(); t += kStep_ns) {
    const rt::Target target = motion.at(t), next = motion.at(t + kStep_ns);
    REQUIRE(target.acceleration.size() == 4);
    speed = std::max(speed, target.velocity.norm());
    jump = std::max(jump, distance(next.position, target.position) / h);
    bend = std::max(bend, distance(next.velocity, target.velocity) / h);
    jerk = std::max(jerk, distance(next.acceleration, target.acceleration) / h);
    const int64_t later_ns = std::min(target.until_ns, t + 40'000'000);
    astray = std::max(astray, distance(target.at(later_ns), motion.at(later_ns).position));
  }
  CHECK(speed <= kSpeed * (1 + 1e-9));
  CHECK(jump <= kSpeed * (1 + 1e-6));
  CHECK(bend <= 0.2 * (1 + 1e-6));
  CHECK(jerk <= 2 * (1 + 1e-6));
  CHECK(astray < 2 * std::pow(0.04, 3) / 6 * 1.01);  // what a jerk moves in 40 ms
  // Then it is at the second waypoint again.
  const EffectorVector here = motion.at(motion.path_start_ns() + motion.round_ns()).position;
  CHECK(motion.round_ns() > 6 * kSecond_ns);
  CHECK(distance(here, vector({0.03, 0, 0.1, -0.05})) < 0.003);
}

TEST_CASE("A path within limits says where it is", "[unit]") {
  const Motion motion(limited(false, 0), kRest, {kStart_ns, kRest});
  CHECK(motion.part(kStart_ns).approach);
  CHECK(motion.part(motion.path_start_ns() + kSecond_ns / 2).to == 1);
  CHECK(motion.part(motion.path_start_ns() + 3 * kSecond_ns).to == 2);
  const int64_t end_ns = motion.path_start_ns() + motion.round_ns();
  CHECK(distance(motion.at(end_ns + 1).position, vector({0.03, 0.04, 0.1, -0.05})) < kRounding);
  CHECK(motion.at(end_ns + 1).velocity.norm() == 0);
}

TEST_CASE("A closed path of so many turns ends where it began", "[unit]") {
  for (const bool within : {false, true}) {
    Config config = within ? limited(true, 0.002) : triangle(true);
    config.motion->turns = 3;
    const Motion motion(config, kRest, {kStart_ns, kRest});
    CHECK(motion.round_ns() > (within ? 17 : 18) * kSecond_ns - 1);
    const int64_t end_ns = motion.path_start_ns() + motion.round_ns();
    CHECK(distance(motion.at(end_ns - kSecond_ns / 2).position, vector({0, 0, 0.1, -0.05})) > 0.001);
    CHECK(motion.part(end_ns - kSecond_ns / 2).to == 0);
    for (const int64_t later_ns : {int64_t{1}, 100 * kSecond_ns})
      CHECK(distance(motion.at(end_ns + later_ns).position, vector({0, 0, 0.1, -0.05})) < kRounding);
  }
}

TEST_CASE("A circle is followed round its origin, the other coordinates rest", "[unit]") {
  Config config = triangle(true);
  config.motion->curve = CurveConfig{{0.01, 0.01, 0}, {1, 1, 0}, {1.5707963267948966, 0, 0}};
  for (const bool within : {false, true}) {
    if (within) config.motion->acceleration = 0.5;
    const Motion motion(config, kRest, {kStart_ns, kRest});
    CHECK(distance(motion.at(motion.path_start_ns()).position, vector({0.01, 0, 0.1, -0.05})) < kRounding);
    for (int64_t t = motion.path_start_ns(); t < motion.path_start_ns() + 5 * kSecond_ns;
         t += 97 * kStep_ns) {
      const rt::Target target = motion.at(t);
      REQUIRE(target.position.head(2).norm() == Approx(0.01));
      REQUIRE(target.position[3] == -0.05);
      REQUIRE(target.velocity.norm() <= kSpeed);
    }
  }
}

}  // namespace tendril::app::motion_test
