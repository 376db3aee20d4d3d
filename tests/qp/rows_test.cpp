// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/qp/brute_force.h"

namespace tendril::qp::rows_test {

constexpr int kCap = 1000;

/// A problem whose rows are not the displacements of the actuators.
struct Rectangular {
  Qp qp;
  Matrix E;
  RowVector compliance;

  Preparation prepare(Problem& problem, TieBreak tie_break) const {
    return problem.prepare(qp.H, E, qp.A, compliance, tie_break);
  }
};

/// @param effectors  fewer than variables make H singular
/// @param room       distance of the rows' bounds from a point within the variables' bounds; negative:
/// conflicts
Rectangular rectangular(std::mt19937_64& random, int variables, int rows, int effectors, double room) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto draw = [&] { return normal(random); };
  const Matrix W_ea = Matrix::NullaryExpr(effectors, variables, draw),
               J = Matrix::NullaryExpr(variables, variables, draw);
  Rectangular result;
  Qp& qp = result.qp;
  qp.A = RowMatrix::NullaryExpr(rows, variables, draw);
  for (int k = 0; k < rows; ++k) qp.A.row(k) *= (0.5 + uniform(random)) / qp.A.row(k).norm();
  qp.H = W_ea.transpose() * W_ea;
  qp.g = W_ea.transpose() * Vector::NullaryExpr(effectors, [&] { return 3 * draw(); });
  result.E = J * J.transpose() + Matrix::Identity(variables, variables);
  result.compliance = RowVector::NullaryExpr(rows, [&] { return std::exp(draw()); });
  qp.bounds.lower = Vector::NullaryExpr(variables, [&] { return -uniform(random); });
  qp.bounds.upper = Vector::NullaryExpr(variables, [&] { return uniform(random); });
  const Vector inside = (qp.bounds.lower + qp.bounds.upper) / 2;
  qp.bounds.row_lower = qp.A * inside - room * RowVector::NullaryExpr(rows, [&] { return uniform(random); });
  qp.bounds.row_upper = qp.A * inside + RowVector::NullaryExpr(rows, [&] { return uniform(random); });
  if (room < 0) qp.bounds.row_upper = qp.bounds.row_lower;
  return result;
}

TEST_CASE("With more and with fewer rows than variables, an answer is as good as the best of all active sets",
          "[law]") {
  const unsigned seed = 20171;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  int active_rows = 0, compared = 0;
  for (int repeat = 0; repeat < 600; ++repeat) {
    const int n = 1 + repeat % 4, rows = repeat / 4 % (2 * n + 4), effectors = n;
    const Rectangular posed = rectangular(random, n, rows, effectors, 0.5);
    const Qp& qp = posed.qp;
    CAPTURE(repeat, n, rows, effectors);
    const std::optional<Vector> best = solve_by_brute_force(qp);
    for (const TieBreak tie_break : {TieBreak::kAny, TieBreak::kLeastEnergy}) {
      Problem problem;
      REQUIRE(posed.prepare(problem, tie_break) == Preparation::kReady);
      REQUIRE(problem.rows() == rows);
      Solver solver;
      const Solution& solution = solver.solve(problem, qp.g, qp.bounds, Vector::Zero(n), kCap);
      CAPTURE(name(solution.status), solution.x.transpose());
      REQUIRE(solution.status == Status::kOptimal);
      REQUIRE((solution.x.array() >= qp.bounds.lower.array()).all());
      REQUIRE((solution.x.array() <= qp.bounds.upper.array()).all());
      const RowVector violation = qp.violation(solution.x).cwiseAbs();
      for (int k = 0; k < rows; ++k) REQUIRE(violation[k] <= 1e-7 * qp.row_scale(solution.x, k));
      active_rows += ((qp.A * solution.x - qp.bounds.row_lower).cwiseAbs().array() < 1e-9).any();
      if (!best) continue;  // the enumeration meets only singular systems
      ++compared;
      REQUIRE(std::abs(qp.objective(solution.x) - qp.objective(*best)) <= 1e-7 * qp.scale(*best));
    }
  }
  CHECK(active_rows > 100);
  CHECK(compared > 800);
}

TEST_CASE("Where rows of any kind conflict, their violations are least, weighed by the rows' compliances",
          "[law]") {
  const unsigned seed = 20172;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  int softened = 0;
  for (int repeat = 0; repeat < 200; ++repeat) {
    const int n = 1 + repeat % 5, rows = n + 1 + repeat % 7;
    const auto [qp, E, compliance] = rectangular(random, n, rows, n, -1);
    Problem problem;
    REQUIRE(problem.prepare(qp.H, E, qp.A, compliance) == Preparation::kReady);
    Solver solver;
    const Solution& solution = solver.solve(problem, qp.g, qp.bounds, Vector::Zero(n), kCap);
    CAPTURE(repeat, n, rows, name(solution.status));
    REQUIRE(solution.status == Status::kSoftened);
    ++softened;
    const Vector& x = solution.x;
    const RowVector v = qp.violation(x);
    REQUIRE(solution.row_violation == Approx(v.cwiseAbs().maxCoeff()).epsilon(1e-9));
    // The slope of ½ Σ v_k²/c_k vanishes, except where a bound of x holds against it.
    const Vector slope = qp.A.transpose() * v.cwiseQuotient(compliance);
    const double scale = (qp.A.cwiseAbs().transpose() * v.cwiseAbs().cwiseQuotient(compliance)).maxCoeff();
    for (int j = 0; j < n; ++j) {
      CAPTURE(j, slope[j], scale);
      if (x[j] > qp.bounds.lower[j] + 1e-6) REQUIRE(slope[j] <= 1e-5 * scale);
      if (x[j] < qp.bounds.upper[j] - 1e-6) REQUIRE(slope[j] >= -1e-5 * scale);
    }
  }
  CHECK(softened > 100);
}

TEST_CASE("The least energy does not depend on whether the energy matrix is among the rows", "[law]") {
  const unsigned seed = 20173;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int repeat = 0; repeat < 100; ++repeat) {
    const int n = 2 + repeat % 6;
    auto [qp, E, compliance] = rectangular(random, n, n, n - 1, 0.5);
    qp.A = E;
    const Vector inside = (qp.bounds.lower + qp.bounds.upper) / 2;
    qp.bounds.row_lower = E * inside - RowVector::Constant(n, 0.3);
    qp.bounds.row_upper = E * inside + RowVector::Constant(n, 0.3);
    Qp reversed = qp;
    reversed.A = qp.A.colwise().reverse();
    reversed.bounds.row_lower = qp.bounds.row_lower.reverse();
    reversed.bounds.row_upper = qp.bounds.row_upper.reverse();
    Problem among, apart;
    REQUIRE(among.prepare(qp.H, E, TieBreak::kLeastEnergy) == Preparation::kReady);
    REQUIRE(apart.prepare(qp.H, E, reversed.A, compliance, TieBreak::kLeastEnergy) == Preparation::kReady);
    Solver one, other;
    const Vector zero = Vector::Zero(n);
    const Solution& expected = one.solve(among, qp.g, qp.bounds, zero, kCap);
    const Solution& solution = other.solve(apart, qp.g, reversed.bounds, zero, kCap);
    CAPTURE(repeat, n, expected.x.transpose(), solution.x.transpose());
    REQUIRE(expected.status == Status::kOptimal);
    REQUIRE(solution.status == Status::kOptimal);
    REQUIRE(std::abs(qp.objective(solution.x) - qp.objective(expected.x)) <= 1e-9 * qp.scale(expected.x));
    REQUIRE(solution.x.isApprox(expected.x, 1e-5));
  }
}

TEST_CASE("Rows are refused that do not fit", "[unit]") {
  const Matrix I = Matrix::Identity(3, 3);
  RowMatrix A = RowMatrix::Ones(5, 3);
  RowVector compliance = RowVector::Ones(5);
  Problem problem;
  REQUIRE(problem.prepare(I, I, A, compliance) == Preparation::kReady);
  REQUIRE(problem.prepare(I, I, RowMatrix::Zero(0, 3), RowVector::Zero(0)) == Preparation::kReady);
  CHECK(problem.rows() == 0);
  Preparation expected = Preparation::kBadSize;
  SECTION("compliances are missing") { A = RowMatrix::Ones(kMaxRows, 3); }
  SECTION("too few columns") { A = RowMatrix::Ones(5, 2); }
  SECTION("a row is not a number") { A(4, 1) = std::nan(""), expected = Preparation::kNotFinite; }
  SECTION("a compliance is zero") { compliance[2] = 0, expected = Preparation::kIndefinite; }
  SECTION("a compliance is infinite") { compliance[2] = kInf, expected = Preparation::kNotFinite; }
  CHECK(problem.prepare(I, I, A, compliance) == expected);
  CHECK(problem.rows() == 0);
}

}  // namespace tendril::qp::rows_test
