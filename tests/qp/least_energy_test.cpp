// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>

#include "tests/qp/brute_force.h"
#include "tests/qp/random_problem.h"

namespace tendril::qp::least_energy_test {

constexpr int kCap = 1000;

/// A redundant robot near a target: fewer effector coordinates than actuators, no energy term in H.
struct Redundant {
  Qp qp;
  Eigen::MatrixXd W_ea;
  Vector d;  // δ_e at zero efforts
};

Redundant redundant_robot(std::mt19937_64& random, int actuators, int coordinates, double distance) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.5, 2);
  const auto fill = [&](auto& values) {
    for (double& entry : values.reshaped()) entry = normal(random);
  };
  Redundant robot;
  robot.W_ea.resize(coordinates, actuators);
  robot.d.resize(coordinates);
  Eigen::MatrixXd J(actuators, actuators + 2);
  fill(robot.W_ea);
  fill(robot.d);
  fill(J);
  robot.d *= distance;
  robot.qp.H = robot.W_ea.transpose() * robot.W_ea;
  robot.qp.A = J * J.transpose() / actuators;
  robot.qp.g = robot.W_ea.transpose() * robot.d;
  Bounds& bounds = robot.qp.bounds;
  bounds.lower.setZero(actuators);
  bounds.upper.resize(actuators);
  bounds.row_upper.resize(actuators);
  for (int a = 0; a < actuators; ++a)
    bounds.upper[a] = uniform(random), bounds.row_upper[a] = 2 * uniform(random);
  bounds.row_lower = -bounds.row_upper;
  return robot;
}

TEST_CASE("Of the efforts that come nearest to the target, those of the least energy are found", "[law]") {
  const unsigned seed = 20161;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  int compared = 0, reached = 0, unreachable = 0;
  for (int repeat = 0; repeat < 300; ++repeat) {
    const int m = 2 + repeat % 3, e = 1 + repeat % (m - 1);
    const auto [qp, W_ea, d] = redundant_robot(random, m, e, repeat % 2 == 0 ? 0.3 : 3);
    Problem any, least;
    REQUIRE(any.prepare(qp.H, qp.A) == Preparation::kReady);
    REQUIRE(least.prepare(qp.H, qp.A, TieBreak::kLeastEnergy) == Preparation::kReady);
    REQUIRE(least.two_levels());
    Solver solver;
    const Vector nearest = solver.solve(any, qp.g, qp.bounds, Vector::Zero(m), kCap).x;
    solver.reset();
    const Solution& solution = solver.solve(least, qp.g, qp.bounds, Vector::Zero(m), kCap);
    CAPTURE(repeat, m, e, name(solution.status), solution.iterations);
    REQUIRE(solution.status == Status::kOptimal);
    const Eigen::VectorXd p = W_ea * solution.x, stroke = W_ea.cwiseAbs() * qp.bounds.upper;
    REQUIRE((p - W_ea * nearest).cwiseAbs().maxCoeff() <= 1e-6 * stroke.maxCoeff());
    ((p + d).norm() < 1e-5 ? reached : unreachable) += 1;

    Qp energy = qp;
    energy.H = qp.A;
    energy.g.setZero();
    const auto best = solve_by_brute_force(energy, W_ea, p);
    if (!best) continue;  // as many constraints active as make the enumeration's system singular
    ++compared;
    CAPTURE(best->transpose(), solution.x.transpose());
    REQUIRE(solution.x.dot(qp.A * solution.x) <= (1 + 1e-5) * best->dot(qp.A * *best) + 1e-12);
  }
  CHECK(reached > 50);
  CHECK(unreachable > 50);
  CHECK(compared > 100);
}

TEST_CASE("With two levels the tip is not held back by the energy, as it is by a weight on it", "[law]") {
  std::mt19937_64 random(20162);
  double held_back = 0;
  for (int repeat = 0; repeat < 50; ++repeat) {
    const auto [qp, W_ea, d] = redundant_robot(random, 4, 2, 0.2);
    Problem weighed, two;
    const double ratio =
        qp.H.cwiseAbs().rowwise().sum().maxCoeff() / qp.A.cwiseAbs().rowwise().sum().maxCoeff();
    REQUIRE(weighed.prepare(qp.H + 1e-3 * ratio * qp.A, qp.A) == Preparation::kReady);
    REQUIRE(two.prepare(qp.H, qp.A, TieBreak::kLeastEnergy) == Preparation::kReady);
    Solver solver;
    const Eigen::VectorXd with_weight =
        W_ea * solver.solve(weighed, qp.g, qp.bounds, Vector::Zero(4), kCap).x + d;
    solver.reset();
    const Eigen::VectorXd with_levels =
        W_ea * solver.solve(two, qp.g, qp.bounds, Vector::Zero(4), kCap).x + d;
    CHECK(with_levels.norm() <= with_weight.norm() + 1e-9);
    if (with_levels.norm() < 1e-7) held_back = std::max(held_back, with_weight.norm());
  }
  CHECK(held_back > 1e-4);
}

TEST_CASE("Efforts of the least energy keep to the bounds at every iteration cap", "[law]") {
  std::mt19937_64 random(20163);
  int capped = 0;
  for (int repeat = 0; repeat < 50; ++repeat) {
    const auto [qp, W_ea, d] = redundant_robot(random, 8, 3, 2);
    Problem problem;
    REQUIRE(problem.prepare(qp.H, qp.A, TieBreak::kLeastEnergy) == Preparation::kReady);
    for (int cap = 0; cap < 20; ++cap) {
      Solver solver;
      const Solution& solution = solver.solve(problem, qp.g, qp.bounds, Vector::Zero(8), cap);
      CAPTURE(repeat, cap, name(solution.status));
      REQUIRE(solution.iterations <= cap);
      REQUIRE((solution.x.array() >= qp.bounds.lower.array()).all());
      REQUIRE((solution.x.array() <= qp.bounds.upper.array()).all());
      if (solution.status != Status::kCapped) continue;
      ++capped;
      REQUIRE((qp.A * solution.x - qp.bounds.row_upper).maxCoeff() <= 1e-9);
      REQUIRE(qp.objective(solution.x) <= 1e-6 * qp.scale(solution.x));
    }
  }
  CHECK(capped > 100);
}

}  // namespace tendril::qp::least_energy_test
