#include <catch2/catch.hpp>

#include "random_problem.h"

namespace tendril::qp {

TEST_CASE("At every iteration cap the answer is within bounds and no worse than holding", "[law]") {
  std::mt19937_64 random(600);
  int capped = 0, better = 0;
  for (int repeat = 0; repeat < 600; ++repeat) {
    const int n = 1 + repeat % 12;
    const Qp qp = random_qp(random, n, repeat % 3 == 0 ? Rows::kArbitrary : Rows::kFeasible);
    Problem problem;
    REQUIRE(problem.prepare(qp.H, qp.A) == Preparation::kReady);
    Solver solver;
    // Half of the time hold a point that meets the rows: the optimum for another target.
    Vector hold = Vector::Zero(n);
    if (repeat % 2 == 0) hold = Vector(solver.solve(problem, -0.3 * qp.g, qp.bounds, hold, 1000).x);
    const Vector held = hold.cwiseMax(qp.bounds.lower).cwiseMin(qp.bounds.upper);
    for (const int cap : {-1, 0, 1, 2, 3, 4, 5, 6, 8, 12, 20}) {
      CAPTURE(n, repeat, cap);
      solver.reset();
      const Solution& solution = solver.solve(problem, qp.g, qp.bounds, hold, cap);
      const Vector& x = solution.x;
      REQUIRE(x.allFinite());
      REQUIRE((x.array() >= qp.bounds.lower.array()).all());
      REQUIRE((x.array() <= qp.bounds.upper.array()).all());
      REQUIRE(solution.iterations <= std::max(cap, 0));
      if (solution.status != Status::kCapped) continue;
      ++capped;
      const Vector now = qp.violation(x), before = qp.violation(held);
      bool met = true;
      for (int k = 0; k < n; ++k) {
        const double rounding = 1e-12 * (qp.row_scale(x, k) + qp.row_scale(held, k));
        CAPTURE(k, now[k], before[k]);
        REQUIRE(std::abs(now[k]) <= std::abs(before[k]) + rounding);
        met = met && before[k] == 0;
      }
      if (met) {
        REQUIRE(qp.objective(x) <= qp.objective(held) + 1e-12 * (qp.scale(x) + qp.scale(held)));
        better += qp.objective(x) < qp.objective(held);
      }
    }
  }
  CHECK(capped > 500);
  CHECK(better > 50);
}

TEST_CASE("With a cap of its own need the solver finishes, with one less it does not", "[unit]") {
  std::mt19937_64 random(601);
  for (int repeat = 0; repeat < 100; ++repeat) {
    CAPTURE(repeat);
    const Qp qp = random_qp(random, 6, Rows::kFeasible);
    Problem problem;
    REQUIRE(problem.prepare(qp.H, qp.A) == Preparation::kReady);
    Solver solver;
    const Vector hold = Vector::Zero(6);
    const Solution& solution = solver.solve(problem, qp.g, qp.bounds, hold, 1000);
    const int needed = solution.iterations;
    const Vector x = solution.x;
    solver.reset();
    CHECK(solver.solve(problem, qp.g, qp.bounds, hold, needed - 1).status == Status::kCapped);
    solver.reset();
    CHECK(solver.solve(problem, qp.g, qp.bounds, hold, needed).status == Status::kOptimal);
    CHECK(solution.x == x);
  }
}

}  // namespace tendril::qp
