// SPDX-License-Identifier: Apache-2.0
#include "fem/body/imposed_displacement.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/fem/body/bodies.h"

namespace tendril::fem::imposed_displacement_test {

using testing::random_vector;
using Flags = Eigen::ArrayX<bool>;

/// W λ + gap under Signorini's conditions, in √J.
struct Problem {
  Eigen::MatrixXd W;
  Eigen::VectorXd gap;
  Flags pull_only;

  bool solve(Eigen::VectorXd& lambda) const {
    return solve_efforts(W, gap, Eigen::VectorXd::Zero(gap.size()), pull_only, lambda);
  }
  /// What is left of the conditions, as a share of the largest gap, whatever the units.
  double residual(const Eigen::VectorXd& lambda) const {
    const Eigen::VectorXd root = W.diagonal().cwiseSqrt(), w = W * lambda + gap;
    double largest = 0;
    for (int i = 0; i < gap.size(); ++i)
      largest = std::max(
          largest, std::abs(pull_only[i] ? std::min(lambda[i] * root[i], w[i] / root[i]) : w[i] / root[i]));
    return largest / gap.cwiseQuotient(root).lpNorm<Eigen::Infinity>();
  }
};

/// @param spread  powers of ten that the units of actuators differ by
Problem random_problem(std::mt19937& random, int m, double spread) {
  const Eigen::MatrixXd A =
      Eigen::MatrixXd::NullaryExpr(m, m + 1, [&] { return std::normal_distribution<double>()(random); });
  const Eigen::VectorXd units = Eigen::pow(10.0, random_vector(random, m, spread).array());
  Problem p{units.asDiagonal() * (A * A.transpose()) * units.asDiagonal(),
            units.cwiseProduct(random_vector(random, m, 1)), Flags(m)};
  for (int i = 0; i < m; ++i) p.pull_only[i] = random() % 3 != 0;
  return p;
}

/// The solution by trial of all sets of taut cables.
Eigen::VectorXd by_trial(const Problem& p) {
  const int m = static_cast<int>(p.gap.size());
  Eigen::VectorXd best = Eigen::VectorXd::Zero(m);
  double least = INFINITY;
  for (unsigned set = 0; set < 1u << m; ++set) {
    Eigen::MatrixXd W = Eigen::MatrixXd::Identity(m, m);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(m);
    for (int i = 0; i < m; ++i)
      if (!p.pull_only[i] || set >> i & 1u) {
        W.row(i) = p.W.row(i);
        right[i] = -p.gap[i];
      }
    const Eigen::VectorXd lambda = W.fullPivLu().solve(right);
    if (const double residual = p.residual(lambda); residual < least) {
      least = residual;
      best = lambda;
    }
  }
  return best;
}

TEST_CASE("Efforts are those that a trial of all sets of taut cables finds", "[law]") {
  const unsigned seed = GENERATE(range(1u, 11u));
  CAPTURE(seed);
  std::mt19937 random(seed);
  for (int m = 1; m <= 6; ++m) {
    CAPTURE(m);
    const Problem p = random_problem(random, m, 0);
    const Eigen::VectorXd expected = by_trial(p);
    Eigen::VectorXd lambda = random_vector(random, m, 1);  // any guess
    REQUIRE(p.solve(lambda));
    CHECK((lambda - expected).norm() <= 1e-6 * expected.norm());
  }
}

TEST_CASE("Signorini's conditions hold for many actuators of different units", "[law]") {
  const unsigned seed = GENERATE(range(11u, 21u));
  CAPTURE(seed);
  std::mt19937 random(seed);
  const Problem p = random_problem(random, kMaxEfforts, 6);
  Eigen::VectorXd lambda = Eigen::VectorXd::Zero(kMaxEfforts);
  REQUIRE(p.solve(lambda));
  CHECK(p.residual(lambda) < 1e-9);
}

TEST_CASE("The units of actuators do not change their efforts", "[law]") {
  std::mt19937 random(31);
  Problem p = random_problem(random, 8, 0);
  Eigen::VectorXd lambda = Eigen::VectorXd::Zero(8), other = lambda;
  REQUIRE(p.solve(lambda));
  const Eigen::VectorXd units = Eigen::pow(10.0, random_vector(random, 8, 8).array());
  p.W = units.asDiagonal() * p.W * units.asDiagonal();
  p.gap = units.cwiseProduct(p.gap);
  REQUIRE(p.solve(other));
  CHECK((units.cwiseProduct(other) - lambda).norm() < 1e-8 * lambda.norm());
}

/// Projected Gauss-Seidel, the usual way to solve contact.
void gauss_seidel(const Problem& p, int sweeps, Eigen::VectorXd& lambda) {
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (int i = 0; i < lambda.size(); ++i) {
      lambda[i] -= (p.W.row(i).dot(lambda) + p.gap[i]) / p.W(i, i);
      if (p.pull_only[i]) lambda[i] = std::max(lambda[i], 0.0);
    }
}

TEST_CASE("Eight nearly parallel cables, on which projected Gauss-Seidel crawls, are solved", "[law]") {
  std::mt19937 random(41);
  Problem p = random_problem(random, 8, 0);
  p.W = Eigen::MatrixXd::Ones(8, 8) + 1e-7 * p.W;
  p.gap = -Eigen::VectorXd::Ones(8) + 1e-7 * p.gap;
  p.pull_only.setConstant(true);
  Eigen::VectorXd crawling = Eigen::VectorXd::Zero(8), lambda = crawling;
  gauss_seidel(p, 20000, crawling);
  REQUIRE(p.solve(lambda));
  CHECK(p.residual(lambda) < 1e-10);
  CHECK(p.residual(crawling) > 1e-10);
  CHECK((crawling - lambda).norm() > 0.01 * lambda.norm());
}

TEST_CASE("Parallel cables on one point: the shortest pulls, equal ones share", "[law]") {
  Problem p{Eigen::MatrixXd::Constant(3, 3, 1e-3), Eigen::Vector3d(-0.001, -0.004, -0.002),
            Flags::Constant(3, true)};
  Eigen::VectorXd lambda = Eigen::Vector3d(1, 0, 1);
  REQUIRE(p.solve(lambda));
  CHECK((lambda - Eigen::Vector3d(0, 4, 0)).norm() < 1e-6);
  p.gap.setConstant(-0.006);
  lambda.setZero();
  REQUIRE(p.solve(lambda));
  CHECK(lambda.sum() == Approx(6).epsilon(1e-9));
  CHECK(lambda.minCoeff() >= 0);
}

TEST_CASE("What no efforts can impose is refused", "[unit]") {
  const Eigen::Matrix2d one = Eigen::Matrix2d::Constant(1e-3);
  const Flags rods = Flags::Constant(2, false);
  Eigen::VectorXd lambda = Eigen::Vector2d::Zero();
  CHECK(Problem{one, Eigen::Vector2d(-0.001, -0.001), rods}.solve(lambda));
  CHECK_FALSE(Problem{one, Eigen::Vector2d(-0.001, -0.002), rods}.solve(lambda));  // one rod, two lengths
  CHECK_FALSE(Problem{Eigen::Vector2d(1, 0).asDiagonal(), Eigen::Vector2d(1, 1), rods}.solve(lambda));
  CHECK_FALSE(Problem{Eigen::Matrix2d::Constant(NAN), Eigen::Vector2d(1, 1), rods}.solve(lambda));
  const Eigen::Matrix2d indefinite{{1, 2}, {2, 1}};
  CHECK_FALSE(Problem{indefinite, Eigen::Vector2d(1, -1), rods}.solve(lambda));
  Eigen::VectorXd many = Eigen::VectorXd::Zero(33);
  CHECK_THROWS_WITH((Problem{Eigen::MatrixXd::Identity(33, 33), many, Flags::Constant(33, true)}.solve(many)),
                    Catch::Contains("33 actuators, expected at most 32"));
}

}  // namespace tendril::fem::imposed_displacement_test
