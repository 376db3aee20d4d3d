// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "tests/qp/random_problem.h"

namespace tendril::qp::warm_start_test {

constexpr int kCycles = 300;
constexpr int kCap = 400;

/// A strictly convex problem, then the same with g, bounds and now and then H and A a little or much changed.
struct Drift {
  explicit Drift(int variables, uint64_t seed) : n(variables), random(seed) { renew(); }

  void renew() {
    do {
      qp = random_qp(random, n, Rows::kFeasible);
      prepared = problem.prepare(qp.H, qp.A) == Preparation::kReady;
    } while (!prepared || problem.proximal());
    qp.bounds.row_lower.setConstant(-kInf);
    g = qp.g;
  }

  void next(int cycle) {
    std::normal_distribution<double> normal;
    if (cycle % 40 == 39) renew();
    if (cycle % 15 == 14) {
      qp.H *= 1.1;
      prepared = problem.prepare(qp.H, qp.A) == Preparation::kReady;
    }
    const double size = cycle % 25 == 24 ? 2 : 0.05;
    for (int j = 0; j < n; ++j) qp.g[j] = g[j] * (1 + size * normal(random));
    const int j = static_cast<int>(random() % n);
    if (cycle % 7 == 0) qp.bounds.upper[j] = std::isinf(qp.bounds.upper[j]) ? qp.bounds.lower[j] : kInf;
    if (std::isinf(qp.bounds.upper[j]) && std::isinf(qp.bounds.lower[j])) qp.bounds.lower[j] = 0;
    if (qp.bounds.upper[j] < qp.bounds.lower[j]) qp.bounds.upper[j] = qp.bounds.lower[j];
  }

  int n;
  std::mt19937_64 random;
  Qp qp;
  Vector g;
  Problem problem;
  bool prepared = false;
};

TEST_CASE("From the working set of the last cycle or from none, the answer is the same", "[law]") {
  for (const int n : {1, 2, 4, 8, 16, 32}) {
    Drift drift(n, 1000 + n);
    Solver warm, cold;
    long warm_iterations = 0, cold_iterations = 0;
    for (int cycle = 0; cycle < kCycles; ++cycle) {
      CAPTURE(n, cycle);
      drift.next(cycle);
      REQUIRE(drift.prepared);
      cold.reset();
      const Vector hold = Vector::Zero(n);
      const Solution& a = warm.solve(drift.problem, drift.qp.g, drift.qp.bounds, hold, kCap);
      const Solution& b = cold.solve(drift.problem, drift.qp.g, drift.qp.bounds, hold, kCap);
      REQUIRE(a.status == b.status);
      if (a.status == Status::kCapped) continue;
      const double scale = drift.qp.scale(b.x) + 1e-300;
      if (a.status == Status::kOptimal)
        REQUIRE(std::abs(drift.qp.objective(a.x) - drift.qp.objective(b.x)) <= 1e-7 * scale);
      warm_iterations += a.iterations;
      cold_iterations += b.iterations;
    }
    CAPTURE(n, warm_iterations, cold_iterations);
    CHECK((n < 4 || warm_iterations < cold_iterations));
  }
}

TEST_CASE("The same calls give the same bits", "[law]") {
  Drift one(8, 42), other(8, 42);
  Solver first, second;
  const Vector hold = Vector::Zero(8);
  for (int cycle = 0; cycle < kCycles; ++cycle) {
    CAPTURE(cycle);
    one.next(cycle);
    other.next(cycle);
    const Solution& a = first.solve(one.problem, one.qp.g, one.qp.bounds, hold, cycle % 3 == 0 ? 4 : kCap);
    const Solution& b =
        second.solve(other.problem, other.qp.g, other.qp.bounds, hold, cycle % 3 == 0 ? 4 : kCap);
    REQUIRE(a.status == b.status);
    REQUIRE(a.iterations == b.iterations);
    REQUIRE(a.x == b.x);
  }
}

TEST_CASE("Repeating a solved problem takes one iteration", "[unit]") {
  Drift drift(8, 7);
  Solver solver;
  const Vector hold = Vector::Zero(8);
  const Vector x = solver.solve(drift.problem, drift.qp.g, drift.qp.bounds, hold, kCap).x;
  const Solution& again = solver.solve(drift.problem, drift.qp.g, drift.qp.bounds, hold, kCap);
  CHECK(again.iterations == 1);
  CHECK(again.x.isApprox(x, 1e-12));
}

}  // namespace tendril::qp::warm_start_test
