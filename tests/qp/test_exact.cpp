#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>

#ifdef TENDRIL_HAS_CGAL
#include "exact_solution.h"
#endif

namespace tendril::qp {

#ifdef TENDRIL_HAS_CGAL
namespace {

/// A problem of small whole numbers, whose products are exact in doubles: redundant and duplicated actuators,
/// degenerate vertices, equal bounds and conflicts are frequent, and H is semidefinite to the last bit.
Qp whole_numbers(std::mt19937_64& random, int n) {
  const auto draw = [&random](int from, int to) {
    return std::uniform_int_distribution<int>(from, to)(random);
  };
  const auto one_in = [&](int count) { return draw(1, count) == 1; };
  const auto matrix = [&](int rows) {
    return Matrix::NullaryExpr(rows, n, [&] { return draw(-3, 3); }).eval();
  };
  Matrix W_ea = matrix(draw(1, n)), J = matrix(n);
  if (n > 1 && one_in(4)) {
    W_ea.col(n - 1) = W_ea.col(0);
    J.col(n - 1) = J.col(0);
  }
  Qp qp;
  qp.A = J.transpose() * J;
  const bool regular = one_in(2);
  qp.H = W_ea.transpose() * W_ea + (regular ? 1 : 0) * Matrix::Identity(n, n);
  qp.g = W_ea.transpose() * Vector::NullaryExpr(W_ea.rows(), [&] { return draw(-20, 20); });
  const auto bounds = [&](int reach, bool finite, Vector& lower, Vector& upper) {
    lower = Vector::NullaryExpr(n, [&] { return draw(-reach, reach / 2); });
    upper = lower;
    for (int k = 0; k < n; ++k) {
      if (!one_in(6)) upper[k] += draw(1, reach);
      if (!finite && one_in(5)) lower[k] = -kInf;
      if (!finite && one_in(5)) upper[k] = kInf;
    }
  };
  bounds(4, !regular, qp.bounds.lower, qp.bounds.upper);
  bounds(20, false, qp.bounds.row_lower, qp.bounds.row_upper);
  if (!one_in(4)) {  // let a point that meets the bounds meet the rows
    const Vector inside = Vector::Zero(n).cwiseMax(qp.bounds.lower).cwiseMin(qp.bounds.upper);
    const Vector violation = qp.violation(inside);
    qp.bounds.row_lower += violation;
    qp.bounds.row_upper += violation;
  }
  return qp;
}

}  // namespace
#endif

TEST_CASE("Exact arithmetic finds the same objective, and the same problems impossible", "[law]") {
#ifndef TENDRIL_HAS_CGAL
  WARN("CGAL was not found when this was built: skipped");
  SUCCEED();
#else
#ifdef TENDRIL_SANITIZED
  constexpr int kProblems = 300;
#else
  constexpr int kProblems = 10000;
#endif
  constexpr std::uint64_t kSeed = 2015;
  std::mt19937_64 random(kSeed);
  int impossible = 0;
  for (int repeat = 0; repeat < kProblems; ++repeat) {
    const int n = 1 + repeat % 7;
    const Qp qp = whole_numbers(random, n);
    CAPTURE(kSeed, repeat, qp.H, qp.A, qp.g.transpose(), qp.bounds.lower.transpose(),
            qp.bounds.upper.transpose(), qp.bounds.row_lower.transpose(), qp.bounds.row_upper.transpose());
    const std::optional<ExactSolution> exact = ExactSolution::of(qp);
    Problem problem;
    REQUIRE(problem.prepare(qp.H, qp.A) == Preparation::kReady);
    Solver solver;
    const Solution& solution = solver.solve(problem, qp.g, qp.bounds, Vector::Zero(n), 1000);
    CAPTURE(name(solution.status), solution.iterations, solution.x.transpose());
    REQUIRE((solution.x.array() >= qp.bounds.lower.array()).all());
    REQUIRE((solution.x.array() <= qp.bounds.upper.array()).all());
    impossible += !exact;
    if (!exact) {
      CHECK(solution.status == Status::kSoftened);
      continue;
    }
    // A row may be off by 1e-9 of its terms, or by 1e-7 where H is singular.
    const bool regular = Eigen::FullPivLU<Matrix>(qp.H).isInvertible();
    CAPTURE(exact->x.transpose(), regular);
    CHECK(solution.status == Status::kOptimal);
    if (solution.status == Status::kOptimal)
      CHECK(std::abs(qp.objective(solution.x) - exact->objective) <=
            (regular ? 1e-8 : 1e-6) * (1 + qp.scale(exact->x)));
  }
  CHECK(impossible > kProblems / 20);
  CHECK(impossible < kProblems / 2);
#endif
}

}  // namespace tendril::qp
