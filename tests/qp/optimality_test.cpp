// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <array>
#include <catch2/catch.hpp>
#include <optional>

#include "tests/qp/brute_force.h"
#include "tests/qp/random_problem.h"

namespace tendril::qp::optimality_test {

constexpr int kCap = 1000;

void check_bounds(const Qp& qp, const Vector& x) {
  REQUIRE(x.allFinite());
  REQUIRE((x.array() >= qp.bounds.lower.array()).all());
  REQUIRE((x.array() <= qp.bounds.upper.array()).all());
}

/// Rows are met to a share of their terms and bounds, or of the size of the whole problem in the metric of
/// H⁻¹.
void check_rows(const Qp& qp, const Problem& problem, const Solution& solution) {
  const Vector violation = qp.violation(solution.x);
  const auto n = static_cast<int>(violation.size());
  Vector problem_scale = Vector::Zero(n);
  if (!problem.proximal()) {
    const Matrix inverse = qp.H.ldlt().solve(Matrix(Matrix::Identity(n, n)));
    const Eigen::VectorXd spread = inverse.diagonal().cwiseSqrt();
    const double size = (solution.x.array() / spread.array()).abs().maxCoeff();
    problem_scale = size * Matrix(qp.A * inverse * qp.A).diagonal().cwiseSqrt();
  }
  for (int k = 0; k < n; ++k) {
    CAPTURE(k, violation[k], problem_scale[k]);
    REQUIRE(std::abs(violation[k]) <= (problem.proximal() ? 1e-7 : 2e-9) * qp.row_scale(solution.x, k) +
                                          3e-10 * (problem_scale[k] + qp.row_response(k)));
  }
  REQUIRE(solution.row_violation == 0);
}

TEST_CASE("An optimal answer is as good as the best of all active sets", "[law]") {
#ifdef TENDRIL_SANITIZED
  const std::array<int, 7> repeats = {0, 200, 200, 100, 0, 0, 0};
#else
  const std::array<int, 7> repeats = {0, 2000, 4000, 3500, 470, 25, 5};
#endif
  std::mt19937_64 random(20151);
  int infeasible = 0, given_up = 0;
  for (int n = 1; n <= 6; ++n) {
    for (int repeat = 0; repeat < repeats[n]; ++repeat) {
      CAPTURE(n, repeat);
      const Qp qp = random_qp(random, n, repeat % 4 == 0 ? Rows::kArbitrary : Rows::kFeasible);
      Problem problem;
      REQUIRE(problem.prepare(qp.H, qp.A) == Preparation::kReady);
      Solver solver;
      const Solution& solution = solver.solve(problem, qp.g, qp.bounds, Vector::Zero(n), kCap);
      check_bounds(qp, solution.x);
      const std::optional<Vector> best = solve_by_brute_force(qp);
      CAPTURE(name(solution.status), solution.row_violation, solution.x.transpose());
      if (!best) {
        ++infeasible;
        // Conflicting rows under a singular H can take the multipliers beyond what doubles hold; then it
        // gives up.
        if (problem.proximal() && solution.status == Status::kCapped)
          ++given_up;
        else
          REQUIRE(solution.status == Status::kSoftened);
        continue;
      }
      CAPTURE(best->transpose(), problem.proximal());
      REQUIRE(solution.status == Status::kOptimal);
      check_rows(qp, problem, solution);
      const double error = qp.objective(solution.x) - qp.objective(*best);
      REQUIRE(std::abs(error) <= 1e-7 * std::max(qp.scale(*best), qp.scale(solution.x)));
    }
  }
  CHECK(infeasible > 50);
  CHECK(given_up * 100 <= infeasible);
}

TEST_CASE("An optimal answer fulfils the Karush-Kuhn-Tucker conditions at every size", "[law]") {
  std::mt19937_64 random(19831);
  for (int n = 1; n <= kMaxVariables; ++n) {
    for (int repeat = 0; repeat < 10; ++repeat) {
      CAPTURE(n, repeat);
      const Qp qp = random_qp(random, n, Rows::kFeasible);
      Problem problem;
      REQUIRE(problem.prepare(qp.H, qp.A) == Preparation::kReady);
      Solver solver;
      const Solution& solution = solver.solve(problem, qp.g, qp.bounds, Vector::Zero(n), kCap);
      const Vector& x = solution.x;
      CAPTURE(solution.iterations, problem.proximal());
      REQUIRE(solution.status == Status::kOptimal);
      check_bounds(qp, x);
      check_rows(qp, problem, solution);

      Vector gradient = qp.H * x + qp.g, size = (qp.H.cwiseAbs() * x.cwiseAbs()) + qp.g.cwiseAbs();
      const Vector rows = qp.A * x;
      for (int k = 0; k < 2 * n; ++k) {
        const bool row = k >= n;
        const int j = row ? k - n : k;
        const double y = solver.multiplier(problem, k), value = row ? rows[j] : x[j];
        gradient += y * (row ? Vector(qp.A.col(j)) : Vector(Vector::Unit(n, j)));
        size += (y * (row ? Vector(qp.A.col(j)) : Vector(Vector::Unit(n, j)))).cwiseAbs();
        const double held = y > 0 ? (row ? qp.bounds.row_upper[j] : qp.bounds.upper[j])
                                  : (row ? qp.bounds.row_lower[j] : qp.bounds.lower[j]);
        if (y != 0)
          REQUIRE(std::abs(value - held) <=
                  1e-7 * (row ? qp.row_scale(x, j) : std::abs(x[j]) + std::abs(held)));
      }
      // In the metric of H⁻¹, where half the square of what is left of the gradient bounds the objective's
      // excess.
      const Matrix H = qp.H + 1e-6 * Matrix(qp.H.diagonal().asDiagonal());
      const double left = gradient.dot(H.ldlt().solve(gradient)), objective_scale = size.dot(x.cwiseAbs());
      REQUIRE(std::sqrt(left) <= 1e-5 * std::sqrt(objective_scale));
    }
  }
}

}  // namespace tendril::qp::optimality_test
