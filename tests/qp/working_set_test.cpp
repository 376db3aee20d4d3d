// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <set>

#include "qp/working_set.h"
#include "tests/qp/random_problem.h"

namespace tendril::qp::working_set_test {

using Side = WorkingSet::Side;

/// The solution of (G_WW + Δ_W) λ = b by a factorisation of its own.
Eigen::VectorXd solve_densely(const Metric& metric, const WorkingSet& set, const Eigen::VectorXd& b) {
  const int size = set.size();
  Eigen::MatrixXd G(size, size);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) G(i, j) = metric.gram(set.constraint(i))[set.constraint(j)];
    G(i, i) += metric.softness(set.constraint(i));
  }
  return G.ldlt().solve(b);
}

TEST_CASE("However constraints came and went, the factor solves like one made anew", "[law]") {
  std::mt19937_64 random(1974);
  std::normal_distribution<double> normal;
  const int n = 8;
  Matrix J(n, n), W(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) J(i, j) = normal(random), W(i, j) = normal(random);
  Problem problem;
  REQUIRE(problem.prepare(W * W.transpose() + Matrix::Identity(n, n), J * J.transpose()) ==
          Preparation::kReady);
  WorkingSet set;
  std::set<int> inside;
  for (int step = 0; step < 500; ++step) {
    const int k = static_cast<int>(random() % (2 * n));
    if (inside.contains(k)) {
      for (int i = 0; i < set.size(); ++i)
        if (set.constraint(i) == k) {
          set.drop(i);
          break;
        }
      inside.erase(k);
    } else if (inside.size() < n) {
      set.add(problem.objective_metric(), k, Side::kBoth);
      inside.insert(k);
    }
    Eigen::VectorXd b(set.size());
    for (double& entry : b) entry = normal(random);
    set.invalidate_b();
    REQUIRE(set.step_towards([&](int i) { return b[i]; }) == -1);
    const Eigen::VectorXd expected = solve_densely(problem.objective_metric(), set, b);
    CAPTURE(step, set.size());
    for (int i = 0; i < set.size(); ++i)
      REQUIRE(set.multiplier(i) == Approx(expected[i]).margin(1e-5 * expected.norm()));
  }
}

TEST_CASE("A multiplier that would change its sign stops all of them where it is zero", "[unit]") {
  Problem problem;
  REQUIRE(problem.prepare(Matrix::Identity(3, 3), Matrix::Identity(3, 3)) == Preparation::kReady);
  WorkingSet set;
  set.add(problem.objective_metric(), 0, Side::kUpper);
  set.add(problem.objective_metric(), 1, Side::kUpper);
  set.add(problem.objective_metric(), 2, Side::kLower);
  const std::array<double, 3> good = {4, 2, -8}, bad = {8, -2, -8};
  REQUIRE(set.step_towards([&](int i) { return good[i]; }) == -1);
  CHECK(set.multiplier(0) == Approx(4));
  set.invalidate_b();
  REQUIRE(set.step_towards([&](int i) { return bad[i]; }) == 1);
  CHECK(set.multiplier(0) == Approx(6));
  CHECK(set.multiplier(1) == 0);
  CHECK(set.multiplier(2) == Approx(-8));
}

}  // namespace tendril::qp::working_set_test
