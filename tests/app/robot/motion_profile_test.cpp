// SPDX-License-Identifier: Apache-2.0
#include "app/robot/motion_profile.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "app/robot/smooth_path.h"

namespace tendril::app::motion_profile_test {

using rt::EffectorVector;

constexpr double kRounding = 1e-9;

EffectorVector point(double x, double y, double z) {
  EffectorVector result(3);
  result << x, y, z;
  return result;
}

/// Random values, the same in every run of one seed.
class Draw {
 public:
  explicit Draw(unsigned seed) : engine_(seed) {}
  double share() { return std::uniform_real_distribution<double>(0, 1)(engine_); }
  bool chance(double probability) { return share() < probability; }
  double size(double least, double greatest) { return least * std::pow(greatest / least, share()); }
  MotionLimits limits() { return {size(1e-3, 1), size(1e-2, 10), size(1e-2, 100)}; }

  /// Waypoints of which some repeat the one before and some lie straight ahead of it or behind.
  std::vector<EffectorVector> waypoints() {
    std::vector<EffectorVector> points;
    const int count = 1 + static_cast<int>(6 * share());
    for (int k = 0; k < count; ++k) {
      const auto side = [&] { return size(1e-3, 0.2) * (chance(0.5) ? 1 : -1); };
      EffectorVector next = point(side(), side(), side());
      if (k > 0 && chance(0.1)) next = points.back();
      if (k > 1 && chance(0.3))
        next = points.back() + (3 * share() - 1) * (points.back() - points[points.size() - 2]);
      points.push_back(next);
    }
    return points;
  }

 private:
  std::mt19937 engine_;
};

/// The greatest speed, acceleration and jerk of a profile as shares of their limits, and its greatest jumps.
struct Extremes {
  double speed = 0, acceleration = 0, jerk = 0;
  double position_jump = 0, velocity_jump = 0, acceleration_jump = 0;
};

/// Looks at each piece: the jerk is constant there, so that its bounds are those at its ends and inside.
Extremes extremes(const MotionProfile& profile, const MotionLimits& limits) {
  constexpr int kLooks = 8;
  Extremes result;
  for (double t = 0; t < profile.duration_s();) {
    const MotionProfile::State begin = profile.at(t);
    const double length = begin.left_s;
    if (length <= 1e-12 * profile.duration_s()) break;  // rounding leaves nothing of the last piece
    const auto inside = [&](double share) { return profile.at(t + share * (1 - 1e-12) * length); };
    for (int k = 0; k <= kLooks; ++k) {
      const MotionProfile::State state = inside(1.0 * k / kLooks);
      result.speed = std::max(result.speed, state.velocity.norm() / limits.speed);
      result.acceleration = std::max(result.acceleration, state.acceleration.norm() / limits.acceleration);
    }
    const MotionProfile::State end = inside(1), next = profile.at(t + (1 + 1e-12) * length);
    result.jerk =
        std::max(result.jerk, (end.acceleration - begin.acceleration).norm() / length / limits.jerk);
    result.position_jump = std::max(result.position_jump, (next.position - end.position).norm());
    result.velocity_jump = std::max(result.velocity_jump, (next.velocity - end.velocity).norm());
    result.acceleration_jump =
        std::max(result.acceleration_jump, (next.acceleration - end.acceleration).norm());
    t += length * (1 + 1e-12);
  }
  return result;
}

void check_bounds(const MotionProfile& profile, const MotionLimits& limits) {
  const Extremes found = extremes(profile, limits);
  CHECK(found.speed < 1 + kRounding);
  CHECK(found.acceleration < 1 + kRounding);
  CHECK(found.jerk < 1 + 1e-6);
  CHECK(found.position_jump < kRounding);
  CHECK(found.velocity_jump < kRounding * (1 + limits.acceleration));
  CHECK(found.acceleration_jump < 1e-6 * (1 + limits.jerk));
}

int pieces(const MotionProfile& profile) {
  int count = 0;
  for (double t = 0; t < profile.duration_s() * (1 - 1e-9); ++count) t += profile.at(t).left_s * (1 + 1e-12);
  return count;
}

TEST_CASE("A long way from rest to rest has seven pieces and the least time that its limits allow", "[law]") {
  const MotionLimits limits{2, 4, 16};
  const MotionProfile profile = rest_to_rest(point(0, 0, 0), point(0, 0, 10), 10, limits);
  // Speed 2 is reached in 2/4 + 4/16 s, half of it on the way, twice: 10/2 + 3/4 s in all.
  CHECK(profile.duration_s() == Approx(5.75));
  CHECK(pieces(profile) == 7);
  check_bounds(profile, limits);
}

TEST_CASE("A short way never stops changing its acceleration, and a middle one does not reach the top speed",
          "[law]") {
  // With the jerk alone: J on four quarters of the time, so d = 2 J (T/4)^3.
  const MotionLimits limits{1, 1, 1};
  CHECK(rest_to_rest(point(0, 0, 0), point(0.25, 0, 0), 0.25, limits).duration_s() == Approx(2));
  // With acceleration and jerk: v (v/A + A/J) = d and T = 2 (v/A + A/J).
  const MotionLimits fast{100, 1, 1};
  CHECK(rest_to_rest(point(0, 0, 0), point(0, 6, 0), 6, fast).duration_s() == Approx(6));
}

TEST_CASE("No way from rest to rest that keeps to the limits is shorter in time", "[law]") {
  const unsigned seed = GENERATE(range(1u, 40u));
  CAPTURE(seed);
  Draw draw(seed);
  const MotionLimits limits = draw.limits();
  const double distance = draw.size(1e-4, 10);
  const MotionProfile profile = rest_to_rest(point(0, 0, 0), point(distance, 0, 0), distance, limits);
  // The fastest way rises with all its might, holds one top speed, and falls: search that speed.
  double best = INFINITY;
  for (int k = 1; k <= 20'000; ++k) {
    const double top = limits.speed * k / 20'000, ramp = ramp_time(top, limits);
    if (top * ramp <= distance) best = std::min(best, 2 * ramp + (distance - top * ramp) / top);
  }
  CHECK(profile.duration_s() <= best * (1 + 1e-9));
  CHECK(pieces(profile) <= 7);
  check_bounds(profile, limits);
  CHECK(profile.at(profile.duration_s()).position == point(distance, 0, 0));
}

TEST_CASE("A target in motion comes to rest within the limits, wherever it is on its way", "[law]") {
  const unsigned seed = GENERATE(range(1u, 60u));
  CAPTURE(seed);
  Draw draw(seed);
  const MotionLimits limits = draw.limits();
  const auto waypoints = draw.waypoints();
  const SmoothPath path = smooth_path(waypoints, false, draw.size(1e-5, 1e-2), limits);
  const MotionProfile::State motion = path.begin.at(draw.share() * path.begin.duration_s());
  const EffectorVector none = point(0, 0, 0);
  const MotionProfile stop(motion, none, point(1, 1, 1), limits);
  check_bounds(stop, limits);
  CHECK((stop.at(0).position - motion.position).norm() < kRounding);
  CHECK((stop.at(0).velocity - motion.velocity).norm() < kRounding);
  CHECK(stop.at(stop.duration_s()).velocity == none);
}

double distance_to_line(const EffectorVector& p, const EffectorVector& a, const EffectorVector& b) {
  const EffectorVector d = b - a;
  const double share = d.squaredNorm() > 0 ? std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
  return (p - a - share * d).norm();
}

TEST_CASE("A path keeps to its limits everywhere, to its corner tolerance, and ends where it should",
          "[law]") {
  const unsigned seed = GENERATE(range(1u, 200u));
  Draw draw(seed);
  const MotionLimits limits = draw.limits();
  const auto waypoints = draw.waypoints();
  const bool closed = draw.chance(0.5);
  const double corners = draw.chance(0.3) ? 0 : draw.size(1e-5, 1e-2);
  CAPTURE(seed, limits.speed, limits.acceleration, limits.jerk, waypoints.size(), closed, corners);
  const SmoothPath path = smooth_path(waypoints, closed, corners, limits);
  const std::size_t legs = waypoints.size() - (closed ? 0 : 1);
  for (const MotionProfile* profile : {&path.begin, path.round ? &*path.round : nullptr}) {
    if (!profile) continue;
    check_bounds(*profile, limits);
    for (int k = 0; k <= 500; ++k) {
      const EffectorVector p = profile->at(profile->duration_s() * k / 500).position;
      double nearest = (p - waypoints[0]).norm();
      for (std::size_t leg = 0; leg < legs; ++leg)
        nearest =
            std::min(nearest, distance_to_line(p, waypoints[leg], waypoints[(leg + 1) % waypoints.size()]));
      REQUIRE(nearest < corners + kRounding);
    }
  }
  CHECK(path.begin.at(0).position == waypoints.front());
  CHECK(path.begin.at(0).velocity.norm() == 0);
  if (!path.round) {
    CHECK(path.begin.at(path.begin.duration_s()).position == waypoints.back());
    CHECK(path.begin.at(path.begin.duration_s()).velocity.norm() == 0);
  } else {
    const MotionProfile::State end = path.begin.at(path.begin.duration_s()), round = path.round->at(0),
                               again = path.round->at(path.round->duration_s() * (1 - 1e-12));
    CHECK((end.position - round.position).norm() < kRounding);
    CHECK((end.velocity - round.velocity).norm() < kRounding);
    CHECK((again.position - round.position).norm() < kRounding);
    CHECK((again.velocity - round.velocity).norm() < kRounding * (1 + limits.acceleration));
  }
}

TEST_CASE(
    "A path passes each waypoint within its corner tolerance, and takes no longer than one that stops there",
    "[law]") {
  const unsigned seed = GENERATE(range(1u, 60u));
  CAPTURE(seed);
  Draw draw(seed);
  const MotionLimits limits = draw.limits();
  const auto waypoints = draw.waypoints();
  const double stopping_s = smooth_path(waypoints, false, 0, limits).begin.duration_s();
  for (const double corners : {0.0, 1e-4, 1e-3, 1e-2}) {
    const MotionProfile profile = smooth_path(waypoints, false, corners, limits).begin;
    CHECK(profile.duration_s() <= stopping_s);
    constexpr int kLooks = 20'000;
    for (const EffectorVector& waypoint : waypoints) {
      double nearest = INFINITY;
      for (int k = 0; k <= kLooks; ++k)
        nearest =
            std::min(nearest, (profile.at(profile.duration_s() * k / kLooks).position - waypoint).norm());
      CHECK(nearest < corners + limits.speed * profile.duration_s() / kLooks + kRounding);
    }
  }
}

TEST_CASE("A corner that may be cut is passed at speed, and costs less time the more may be cut", "[unit]") {
  const MotionLimits limits{0.05, 0.5, 10};
  const std::vector<EffectorVector> corner{point(0, 0, 0), point(0.1, 0, 0), point(0.1, 0.1, 0)};
  double before_s = INFINITY;
  for (const double corners : {0.0, 5e-4, 1e-3}) {
    const MotionProfile profile = smooth_path(corner, false, corners, limits).begin;
    CHECK(profile.duration_s() < before_s);
    before_s = profile.duration_s();
    const double passed = (profile.at(before_s / 2).position - corner[1]).norm();
    CHECK(passed <= corners + kRounding);
    CHECK(passed > 0.9 * corners - kRounding);
  }
}

TEST_CASE("A path that runs straight through a waypoint does not slow down there", "[unit]") {
  const MotionLimits limits{0.1, 1, 10};
  const SmoothPath bent = smooth_path({point(0, 0, 0), point(0.1, 0, 0), point(0.2, 0, 0)}, false, 0, limits);
  CHECK(bent.begin.duration_s() ==
        Approx(rest_to_rest(point(0, 0, 0), point(0.2, 0, 0), 0.2, limits).duration_s()));
  CHECK(bent.begin.at(bent.begin.duration_s() / 2).velocity[0] == Approx(0.1));
}

}  // namespace tendril::app::motion_profile_test
