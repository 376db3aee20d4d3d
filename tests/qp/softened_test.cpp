// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/qp/brute_force.h"

namespace tendril::qp::softened_test {

/// Σ v_k² / A_kk over the rows' violations v at x.
double energy(const Qp& qp, const Vector& x) {
  return qp.violation(x).cwiseAbs2().cwiseQuotient(qp.A.diagonal()).sum();
}

/// A minimiser of energy() within the bounds: coordinate descent, each coordinate by bisection of the
/// monotone slope.
Vector least_violation(const Qp& qp) {
  const int n = static_cast<int>(qp.g.size());
  Vector x = Vector::Zero(n).cwiseMax(qp.bounds.lower).cwiseMin(qp.bounds.upper);
  for (int sweep = 0; sweep < 3000; ++sweep) {
    for (int j = 0; j < n; ++j) {
      double low = qp.bounds.lower[j], high = qp.bounds.upper[j];
      for (int step = 0; step < 60; ++step) {
        x[j] = (low + high) / 2;
        const double slope = qp.violation(x).cwiseQuotient(qp.A.diagonal()).dot(qp.A.col(j));
        (slope > 0 ? high : low) = x[j];
      }
    }
  }
  return x;
}

/// Two to four actuators, well apart, that cannot do what the rows ask within finite bounds.
Qp conflict(std::mt19937_64& random, int n) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto draw = [&] { return uniform(random); };
  Qp qp;
  const Matrix J = Matrix::NullaryExpr(n, n, draw), W_ea = Matrix::NullaryExpr(n, n, draw);
  qp.A = J * J.transpose() + 0.3 * Matrix::Identity(n, n);
  qp.H = W_ea * W_ea.transpose() + 0.1 * qp.A;
  qp.g = Vector::NullaryExpr(n, draw);
  qp.bounds.lower = Vector::Constant(n, -0.5) + 0.4 * Vector::NullaryExpr(n, draw);
  qp.bounds.upper = Vector::Constant(n, 0.5) + 0.4 * Vector::NullaryExpr(n, draw);
  qp.bounds.row_lower = 2 * Vector::NullaryExpr(n, draw);
  qp.bounds.row_upper = qp.bounds.row_lower + Vector::NullaryExpr(n, draw).cwiseAbs();
  for (int k = 0; k < n; ++k)
    if (random() % 4 == 0) qp.bounds.row_upper[k] = kInf;
  return qp;
}

TEST_CASE("Where rows conflict the violation's energy is least, and the objective second", "[law]") {
#ifdef TENDRIL_SANITIZED
  constexpr int kRepeats = 6;
#else
  constexpr int kRepeats = 60;
#endif
  std::mt19937_64 random(2016);
  int conflicts = 0;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    const int n = 2 + repeat % 3;
    CAPTURE(n, repeat);
    Qp qp = conflict(random, n);
    const Vector reference = least_violation(qp);
    const double least = energy(qp, reference);
    if (least < 1e-6) continue;
    ++conflicts;
    Problem problem;
    REQUIRE(problem.prepare(qp.H, qp.A) == Preparation::kReady);
    Solver solver;
    const Solution& solution = solver.solve(problem, qp.g, qp.bounds, Vector::Zero(n), 1000);
    REQUIRE(solution.status == Status::kSoftened);
    REQUIRE((solution.x.array() >= qp.bounds.lower.array()).all());
    REQUIRE((solution.x.array() <= qp.bounds.upper.array()).all());
    REQUIRE(energy(qp, solution.x) == Approx(least).epsilon(1e-5));
    REQUIRE(solution.row_violation == Approx(qp.violation(solution.x).cwiseAbs().maxCoeff()).epsilon(1e-9));

    const Vector violation = qp.violation(reference);
    Qp relaxed = qp;
    for (int k = 0; k < n; ++k) {
      relaxed.bounds.row_lower[k] += std::min(violation[k], 0.0) - 1e-7;
      relaxed.bounds.row_upper[k] += std::max(violation[k], 0.0) + 1e-7;
    }
    const std::optional<Vector> best = solve_by_brute_force(relaxed);
    REQUIRE(best);
    REQUIRE(qp.objective(solution.x) == Approx(qp.objective(*best)).margin(1e-4 * qp.scale(*best)));
  }
  CHECK(conflicts > kRepeats / 3);
}

TEST_CASE("A row that no actuator moves is conceded and the rest solved as if it were not there", "[unit]") {
  Matrix A = Matrix::Identity(3, 3);
  A(1, 1) = 0;
  const Matrix H = Matrix::Identity(3, 3);
  const Vector g = (Vector(3) << -1, -2, -3).finished();
  Bounds bounds{Vector::Constant(3, -10), Vector::Constant(3, 10), Vector::Constant(3, -1),
                Vector::Constant(3, 2)};
  bounds.row_lower[1] = 0.5;
  Problem problem;
  REQUIRE(problem.prepare(H, A) == Preparation::kReady);
  Solver solver;
  const Solution& solution = solver.solve(problem, g, bounds, Vector::Zero(3), 100);
  CHECK(solution.status == Status::kSoftened);
  CHECK(solution.row_violation == Approx(0.5));
  CHECK(solution.x[0] == Approx(1));
  CHECK(solution.x[1] == Approx(2));
  CHECK(solution.x[2] == Approx(2));
}

TEST_CASE("Once the conflict is over the rows are met again at once", "[unit]") {
  const Matrix H = Matrix::Identity(2, 2), A = (Matrix(2, 2) << 1, 0.3, 0.3, 1).finished();
  const Vector g = Vector::Constant(2, -3), hold = Vector::Zero(2);
  const Bounds sound{Vector::Zero(2), Vector::Ones(2), Vector::Constant(2, -1), Vector::Constant(2, 0.8)};
  Bounds hard = sound;
  hard.row_lower[0] = hard.row_upper[0] = 4;
  Problem problem;
  REQUIRE(problem.prepare(H, A) == Preparation::kReady);
  Solver solver, fresh;
  for (int cycle = 0; cycle < 100; ++cycle) {
    CHECK(solver.solve(problem, g, hard, hold, 100).status == Status::kSoftened);
    const Solution& solution = solver.solve(problem, g, sound, hold, 100);
    CHECK(solution.status == Status::kOptimal);
    CHECK(solution.x.isApprox(fresh.solve(problem, g, sound, hold, 100).x, 1e-9));
  }
}

}  // namespace tendril::qp::softened_test
