// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/qp/random_problem.h"

namespace tendril::qp::problem_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST_CASE("Matrices that are no Hessian and no compliance are refused by name", "[unit]") {
  Matrix H = (Matrix(2, 2) << 2, 1, 1, 3).finished(), A = (Matrix(2, 2) << 1, 0.2, 0.2, 1).finished();
  Problem problem;
  REQUIRE(problem.prepare(H, A) == Preparation::kReady);
  REQUIRE(problem.n() == 2);
  Preparation expected = Preparation::kReady;
  SECTION("H is not a number") { H(0, 1) = kNaN, expected = Preparation::kNotFinite; }
  SECTION("A is infinite") { A(1, 1) = kInf, expected = Preparation::kNotFinite; }
  SECTION("H is not symmetric") { H(0, 1) = 1.001, expected = Preparation::kNotSymmetric; }
  SECTION("A is not symmetric") { A(1, 0) = 0.3, expected = Preparation::kNotSymmetric; }
  SECTION("H has a negative diagonal") { H(0, 0) = -1e-9, expected = Preparation::kIndefinite; }
  SECTION("A has a negative diagonal") { A(0, 0) = -1, expected = Preparation::kIndefinite; }
  SECTION("H has a negative eigenvalue") { H(0, 1) = H(1, 0) = 2.6, expected = Preparation::kIndefinite; }
  SECTION("H is not square") { H.conservativeResize(2, 1), expected = Preparation::kBadSize; }
  SECTION("A is of another size") { A = Matrix::Identity(3, 3), expected = Preparation::kBadSize; }
  SECTION("both are empty") { H.resize(0, 0), A.resize(0, 0), expected = Preparation::kBadSize; }
  REQUIRE(problem.prepare(H, A) == expected);
  CHECK(problem.n() == (expected == Preparation::kReady ? 2 : 0));
  CHECK((problem.id() == 0) == (expected != Preparation::kReady));
}

TEST_CASE("A three by three with sound two by twos is still refused when indefinite", "[unit]") {
  const Matrix H = (Matrix(3, 3) << 1, 0.9, -0.9, 0.9, 1, 0.9, -0.9, 0.9, 1).finished();
  Problem problem;
  CHECK(problem.prepare(H, Matrix::Identity(3, 3)) == Preparation::kIndefinite);
}

TEST_CASE("Semidefinite, tiny and zero matrices are accepted", "[unit]") {
  Problem problem;
  CHECK(problem.prepare(Matrix::Ones(3, 3), Matrix::Ones(3, 3)) == Preparation::kReady);
  CHECK(problem.proximal());
  CHECK(problem.prepare(1e-12 * Matrix::Identity(3, 3), 1e-6 * Matrix::Identity(3, 3)) ==
        Preparation::kReady);
  CHECK_FALSE(problem.proximal());
  CHECK(problem.prepare(Matrix::Zero(3, 3), Matrix::Identity(3, 3)) == Preparation::kReady);
  CHECK(problem.prepare(Matrix::Identity(3, 3), Matrix::Zero(3, 3)) == Preparation::kReady);
}

TEST_CASE("Each preparation has an identity of its own, which copies share", "[unit]") {
  Problem first, second;
  REQUIRE(first.prepare(Matrix::Identity(2, 2), Matrix::Identity(2, 2)) == Preparation::kReady);
  REQUIRE(second.prepare(Matrix::Identity(2, 2), Matrix::Identity(2, 2)) == Preparation::kReady);
  CHECK(first.id() != second.id());
  CHECK(Problem(first).id() == first.id());
}

TEST_CASE("G is the inverse Hessian seen by the constraints, scaled to a diagonal near one", "[law]") {
  std::mt19937_64 random(5);
  int compared = 0;
  for (int repeat = 0; repeat < 100; ++repeat) {
    const int n = 1 + repeat % 8;
    const Qp qp = random_qp(random, n, Rows::kFeasible);
    Problem problem;
    REQUIRE(problem.prepare(qp.H, qp.A) == Preparation::kReady);
    if (problem.proximal()) continue;
    ++compared;
    const Metric& metric = problem.objective_metric();
    Eigen::MatrixXd C(2 * n, n);
    C << Eigen::MatrixXd::Identity(n, n), qp.A;
    for (int c = 0; c < 2 * n; ++c) {
      const int k = metric.number(c);
      int exponent = 0;
      REQUIRE(std::frexp(metric.weight(k), &exponent) == 0.5);
      REQUIRE(metric.weight(k) * metric.unit(k) == 1);
      REQUIRE(metric.gram(k)[k] > 0.49);
      REQUIRE(metric.gram(k)[k] < 2.01);
      C.row(c) *= metric.weight(k);
    }
    const Eigen::VectorXd d = qp.H.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd S = d.asDiagonal() * Eigen::MatrixXd(qp.H) * d.asDiagonal(),
                          CD = C * d.asDiagonal();
    const Eigen::MatrixXd G = CD * S.ldlt().solve(CD.transpose());
    for (int k = 0; k < 2 * n; ++k)
      for (int i = 0; i < 2 * n; ++i)
        REQUIRE(metric.gram(metric.number(k))[metric.number(i)] == Approx(G(i, k)).margin(1e-6));
  }
  CHECK(compared > 20);
}

TEST_CASE("What G says of a point is off by no more than its error times the terms", "[law]") {
  using Exact = Eigen::Matrix<long double, Eigen::Dynamic, 1>;
  std::mt19937_64 random(51);
  std::normal_distribution<double> normal;
  double tightest = 0;
  for (int repeat = 0; repeat < 200; ++repeat) {
    const int n = 1 + repeat % 32;
    CAPTURE(n, repeat);
    const Qp qp = random_qp(random, n, Rows::kFeasible);
    Problem problem;
    REQUIRE(problem.prepare(qp.H, qp.A) == Preparation::kReady);
    const Metric& metric = problem.objective_metric();
    // Multipliers of a few constraints, scaled, and a gradient.
    Eigen::VectorXd lambda = Eigen::VectorXd::Zero(2 * n);
    for (int i = 0; i < n; ++i) lambda[static_cast<int>(random() % (2 * n))] = normal(random);
    Exact gamma(n), values = Exact::Zero(2 * n);
    for (int j = 0; j < n; ++j) gamma[j] = normal(random);
    for (int k = 0; k < 2 * n; ++k)
      for (int i = 0; i < 2 * n; ++i)
        values[i] -= static_cast<long double>(metric.gram(metric.number(k))[metric.number(i)]) *
                     (lambda[k] + (k < n ? gamma[k] : 0));
    Exact slope = gamma, rows = Exact::Zero(n);
    for (int j = 0; j < n; ++j) {
      slope[j] += lambda[j];
      for (int i = 0; i < n; ++i) {
        slope[i] += metric.q(j)[i] * values[j] +
                    metric.q(i)[metric.number(n + j)] * static_cast<long double>(lambda[n + j]);
        rows[i] += metric.q(j)[metric.number(n + i)] * values[j];
      }
    }
    const auto terms = static_cast<double>(lambda.cwiseAbs().sum() + gamma.cwiseAbs().sum());
    const auto off = static_cast<double>(
        std::max(slope.cwiseAbs().maxCoeff(), (rows - values.tail(n)).cwiseAbs().maxCoeff()));
    REQUIRE(off <= metric.error() * terms);
    if (!problem.proximal()) tightest = std::max(tightest, off / (metric.error() * terms));
  }
  CHECK(tightest > 1e-3);
}

}  // namespace tendril::qp::problem_test
