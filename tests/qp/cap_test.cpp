// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "tests/qp/random_problem.h"
#include "tests/qp/sequence.h"

namespace tendril::qp::cap_test {

/// Requires what solve() promises of a capped answer, and returns whether it improves on holding.
bool check_no_worse(const Qp& qp, const Vector& x, const Vector& held) {
  const Vector now = qp.violation(x), before = qp.violation(held);
  bool met = true;
  for (int k = 0; k < x.size(); ++k) {
    const double rounding = 1e-12 * (qp.row_scale(x, k) + qp.row_scale(held, k));
    CAPTURE(k, now[k], before[k]);
    REQUIRE(std::abs(now[k]) <= std::abs(before[k]) + rounding);
    met = met && before[k] == 0;
  }
  if (met) REQUIRE(qp.objective(x) <= qp.objective(held) + 1e-12 * (qp.scale(x) + qp.scale(held)));
  return met && qp.objective(x) < qp.objective(held);
}

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
      better += check_no_worse(qp, x, held);
    }
  }
  CHECK(capped > 500);
  CHECK(better > 50);
}

TEST_CASE("Recorded control cycles under every iteration cap keep to the bounds, no worse than holding",
          "[law]") {
  const auto files = sequence_files();
  if (files.empty()) {
    WARN("no recorded sequences in " TENDRIL_SHARED_DATA "/qp: skipped");
    SUCCEED();
    return;
  }
#ifdef TENDRIL_SANITIZED
  const std::vector<int> caps = {1, 3};
#else
  const std::vector<int> caps = {1, 2, 3, 4, 5, 6, 8, 12, 20};
#endif
  int capped = 0, better = 0;
  for (const auto& file : files) {
    const Sequence sequence = read_sequence(file);
    std::vector<Problem> problems(sequence.snapshots.size());
    for (std::size_t i = 0; i < problems.size(); ++i)
      REQUIRE(problems[i].prepare(sequence.snapshots[i].H, sequence.snapshots[i].A) == Preparation::kReady);
    for (const int cap : caps) {
      Solver solver;
      Vector hold = Vector::Zero(problems[0].n());
      for (std::size_t i = 0; i < sequence.ticks.size(); ++i) {
        const Sequence::Tick& tick = sequence.ticks[i];
        const Solution& solution = solver.solve(problems[tick.snapshot], tick.g, tick.bounds, hold, cap);
        CAPTURE(sequence.name, cap, i, name(solution.status));
        REQUIRE((solution.x.array() >= tick.bounds.lower.array()).all());
        REQUIRE((solution.x.array() <= tick.bounds.upper.array()).all());
        REQUIRE(solution.iterations <= cap);
        if (solution.status == Status::kCapped) {
          const auto& [H, A] = sequence.snapshots[tick.snapshot];
          const Vector held = hold.cwiseMax(tick.bounds.lower).cwiseMin(tick.bounds.upper);
          better += check_no_worse({H, A, tick.g, tick.bounds}, solution.x, held);
          ++capped;
        }
        hold = solution.x;
      }
    }
  }
  CHECK(capped > 1000);
  CHECK(better > 100);
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

}  // namespace tendril::qp::cap_test
