// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "tests/qp/random_problem.h"

namespace tendril::qp::ill_posed_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Qp two_cables() {
  Qp qp;
  qp.H = (Matrix(2, 2) << 2, 1, 1, 3).finished();
  qp.A = (Matrix(2, 2) << 1, 0.2, 0.2, 1).finished();
  qp.g = (Vector(2) << -1, 2).finished();
  qp.bounds = {Vector::Constant(2, 0), Vector::Constant(2, 5), Vector::Constant(2, -4),
               Vector::Constant(2, 4)};
  return qp;
}

TEST_CASE("A question that makes no sense is answered by the last command, clipped", "[unit]") {
  Qp qp = two_cables();
  Vector hold = (Vector(2) << 7, 1).finished();
  Problem problem;
  REQUIRE(problem.prepare(qp.H, qp.A) == Preparation::kReady);
  Solver solver;
  Vector expected = (Vector(2) << 5, 1).finished();

  SECTION("g is not a number") { qp.g[1] = kNaN; }
  SECTION("g is infinite") { qp.g[0] = kInf; }
  SECTION("g has another size") { qp.g = Vector::Zero(3); }
  SECTION("a row's bounds contradict each other") { qp.bounds.row_lower[0] = 4.5; }
  SECTION("a row's bound is not a number") { qp.bounds.row_upper[1] = kNaN; }
  SECTION("a bound has another size") { qp.bounds.row_upper = Vector::Zero(1); }
  SECTION("a bound excludes every number") { qp.bounds.row_lower[0] = qp.bounds.row_upper[0] = kInf; }
  SECTION("a lower bound is not a number") { qp.bounds.lower[0] = kNaN; }
  SECTION("an upper bound is not a number") {
    qp.bounds.upper[0] = kNaN;
    expected[0] = 7;
  }
  SECTION("the command was not a number either") {
    qp.g[0] = kNaN;
    hold[0] = kNaN;
    expected[0] = 0;
  }
  SECTION("the problem was refused") {
    qp.H(0, 0) = kNaN;
    REQUIRE(problem.prepare(qp.H, qp.A) == Preparation::kNotFinite);
  }
  const Solution& solution = solver.solve(problem, qp.g, qp.bounds, hold, 100);
  CHECK(solution.status == Status::kIllPosed);
  CHECK(solution.x == expected);
  CHECK(solution.iterations == 0);
}

TEST_CASE("After a question that made no sense the next one is answered as ever", "[unit]") {
  const Qp qp = two_cables();
  Problem problem;
  REQUIRE(problem.prepare(qp.H, qp.A) == Preparation::kReady);
  Solver solver, undisturbed;
  const Vector hold = Vector::Zero(2);
  solver.solve(problem, Vector::Constant(2, kNaN), qp.bounds, hold, 100);
  solver.solve(problem, Vector::Constant(2, 1e308), qp.bounds, hold, 100);
  CHECK(solver.solve(problem, qp.g, qp.bounds, hold, 100).status == Status::kOptimal);
  CHECK(solver.solve(problem, qp.g, qp.bounds, hold, 100)
            .x.isApprox(undisturbed.solve(problem, qp.g, qp.bounds, hold, 100).x, 1e-12));
}

TEST_CASE("Whatever bits come in, finite numbers within sound bounds come out", "[law]") {
  std::mt19937_64 random(754);
  auto bits = [&random](double& value) {  // specials, or any 64 bits at all
    const std::array<double, 10> specials = {kNaN,  kInf,   -kInf,  0.0,    -0.0,
                                             1e308, -1e308, 5e-324, 1e-300, 1.0};
    const uint64_t pattern = random();
    if (random() % 4 != 0)
      value = specials[random() % specials.size()];
    else
      std::memcpy(&value, &pattern, sizeof value);
  };
  Problem problem;
  Solver solver;
  std::array<int, 4> ended{};
  for (int repeat = 0; repeat < 4000; ++repeat) {
    CAPTURE(repeat);
    const int n = 1 + repeat % 5;
    Qp qp = random_qp(random, n, Rows::kArbitrary);
    Vector hold = Vector::Zero(n);
    const std::array<double*, 6> inputs = {qp.g.data(),
                                           hold.data(),
                                           qp.bounds.lower.data(),
                                           qp.bounds.upper.data(),
                                           qp.bounds.row_lower.data(),
                                           qp.bounds.row_upper.data()};
    for (uint64_t i = random() % 4; i > 0; --i) bits(inputs[random() % 6][random() % n]);
    if (repeat % 10 == 0) bits(qp.H(static_cast<int>(random() % n), 0));
    if (repeat % 10 == 5) bits(qp.A(static_cast<int>(random() % n), 0));
    problem.prepare(qp.H, qp.A);
    const Solution& solution = solver.solve(problem, qp.g, qp.bounds, hold, 200);
    ++ended[static_cast<std::size_t>(solution.status)];
    REQUIRE(solution.iterations <= 200);
    REQUIRE(solution.x.size() == n);
    REQUIRE(solution.x.allFinite());
    for (int j = 0; j < n; ++j) {
      const double lower = qp.bounds.lower[j], upper = qp.bounds.upper[j];
      if (!(lower <= upper && lower < kInf && upper > -kInf)) continue;
      REQUIRE(solution.x[j] >= lower);
      REQUIRE(solution.x[j] <= upper);
    }
  }
  for (const int count : ended) CHECK(count > 0);
}

}  // namespace tendril::qp::ill_posed_test
