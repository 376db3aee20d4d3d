// SPDX-License-Identifier: Apache-2.0
#include "app/robot/curve_path.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>

namespace tendril::app::curve_path_test {

/// A circle of 20 mm in the plane of x and y.
CurveConfig circle() { return {{0.01, 0.01, 0}, {1, 1, 0}, {std::numbers::pi / 2, 0, 0}}; }

TEST_CASE("Without limits a circle is passed at constant speed, from its greatest x towards y", "[unit]") {
  const CurvePath path(circle(), 2, 0.02, std::nullopt);
  const double turn_s = 2 * std::numbers::pi * 0.01 / 0.02;
  CHECK(path.round_s() == Approx(2 * turn_s).epsilon(2e-3));
  CHECK((path.at(0).position - Eigen::Vector3d(0.01, 0, 0)).norm() < 1e-9);
  CHECK((path.at(path.round_s() / 8).position - Eigen::Vector3d(0, 0.01, 0)).norm() < 1e-9);
  CHECK(path.at(0.3).velocity.norm() == Approx(0.02).epsilon(2e-3));
  CHECK(path.at(0.3).velocity.norm() <= 0.02);
  CHECK(path.at(2 * path.round_s()).velocity.norm() == 0);
  CHECK((path.at(2 * path.round_s()).position - Eigen::Vector3d(0.01, 0, 0)).norm() < 1e-9);
}

TEST_CASE("A curve keeps to its limits of speed, acceleration and jerk and does not jump", "[law]") {
  const unsigned seed = GENERATE(range(1u, 60u));
  std::mt19937 engine(seed);
  const auto share = [&] { return std::uniform_real_distribution<double>(0, 1)(engine); };
  const auto size = [&](double least, double greatest) {
    return least * std::pow(greatest / least, share());
  };
  const auto whole = [&] { return 1 + std::floor(5 * share()); };
  const CurveConfig curve{{size(1e-3, 0.1), size(1e-3, 0.1), 0}, {whole(), whole(), 0}, {3 * share(), 0, 0}};
  const MotionLimits limits{size(1e-3, 1), size(1e-2, 10), size(1e-2, 100)};
  const std::optional<int> turns = share() < 0.5 ? std::optional(2) : std::nullopt;
  CAPTURE(seed, limits.speed, limits.acceleration, limits.jerk);
  const CurvePath path(curve, turns, limits.speed, limits);
  constexpr int kLooks = 20'000;
  const double h = 2.5 * path.round_s() / kLooks;
  double speed = 0, acceleration = 0, jerk = 0, jump = 0, bend = 0;
  for (int k = 0; k < kLooks; ++k) {
    const MotionProfile::State state = path.at(k * h), next = path.at((k + 1) * h);
    speed = std::max(speed, state.velocity.norm());
    acceleration = std::max(acceleration, state.acceleration.norm());
    jerk = std::max(jerk, (next.acceleration - state.acceleration).norm() / h);
    jump = std::max(jump, (next.position - state.position).norm());
    bend = std::max(bend, (next.velocity - state.velocity).norm());
  }
  CHECK(speed <= limits.speed);
  CHECK(acceleration <= limits.acceleration);
  CHECK(jerk <= limits.jerk * (1 + 1e-9));
  CHECK(jump <= limits.speed * h * (1 + 1e-9));
  CHECK(bend <= limits.acceleration * h * (1 + 1e-9));
  // One of the three keeps it from being faster.
  if (!turns)
    CHECK(std::max({speed / limits.speed, 2 * acceleration / limits.acceleration, 3 * jerk / limits.jerk}) >
          0.6);
  if (turns) {
    CHECK(path.at(path.round_s()).velocity.norm() < 1e-12);
    CHECK((path.at(path.round_s()).position - path.at(0).position).norm() < 1e-9);
  }
}

}  // namespace tendril::app::curve_path_test
