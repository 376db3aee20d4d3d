// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <cstdlib>

#include "tests/qp/adversarial_problem.h"
#include "tests/qp/certificate.h"

namespace tendril::qp::fuzz_test {

constexpr int kCap = 1000;
constexpr double kMet = 1e-7;       // of its terms, to which a row is met,
constexpr double kResponse = 1e-9;  // and of Qp::row_response()

/// Value of an environment variable that holds a number, or another one where it is not set.
long environment(const char* name, long otherwise) {
  const char* value = std::getenv(name);
  return value ? std::atol(value) : otherwise;
}

/// Smallest eigenvalue of H scaled to a unit diagonal.
double regularity(const Matrix& H) {
  const Vector scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd S = scale.asDiagonal() * H * scale.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(S, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
}

/// Requires what holds for every answer to this problem; returns whether it was solved.
bool check_answer(const AdversarialProblem& posed, const Solution& solution) {
  const Qp& qp = posed.qp;
  const Vector& x = solution.x;
  REQUIRE(x.size() == qp.g.size());
  REQUIRE(x.allFinite());
  REQUIRE(solution.iterations <= kCap);
  REQUIRE((solution.status == Status::kIllPosed) == !posed.well_posed);
  if (!posed.well_posed) return true;
  REQUIRE((x.array() >= qp.bounds.lower.array()).all());
  REQUIRE((x.array() <= qp.bounds.upper.array()).all());
  const Vector violation = qp.violation(x);
  for (int k = 0; k < x.size(); ++k) {
    CAPTURE(k, violation[k], qp.row_scale(x, k));
    // What is feasible by a hair's breadth may be called impossible: then the violation is as small.
    if (solution.status == Status::kOptimal || (solution.status == Status::kSoftened && posed.feasible))
      REQUIRE(std::abs(violation[k]) <= kMet * qp.row_scale(x, k) + kResponse * qp.row_response(k));
  }
  if (solution.status == Status::kSoftened) REQUIRE(solution.row_violation > 0);
  if (solution.status == Status::kOptimal)
    REQUIRE(stationarity(qp, x) <= (regularity(qp.H) > 1e-6 ? 1e-7 : 1e-4));
  return posed.extreme || solution.status != Status::kCapped;
}

// TENDRIL_QP_PROBLEMS says how many problems, TENDRIL_QP_SEED which is the first: a failure prints its own.
TEST_CASE("However a problem is made worse, what is called solved is solved", "[law][fuzz]") {
#ifdef TENDRIL_SANITIZED
  const long count = environment("TENDRIL_QP_PROBLEMS", 1000);
#else
  const long count = environment("TENDRIL_QP_PROBLEMS", 20000);
#endif
  const long first = environment("TENDRIL_QP_SEED", 1);
  long unsolved = 0, first_unsolved = 0;
  for (long seed = first; seed < first + count; ++seed) {
    CAPTURE(seed);
    AdversarialProblem posed(static_cast<uint64_t>(seed));
    const Vector hold = Vector::Zero(posed.qp.g.size());
    Problem problem;
    REQUIRE(problem.prepare(posed.qp.H, posed.qp.A) == Preparation::kReady);
    Solver solver;
    // The same problem twice, the second time from the working set of the first for another target.
    for (const double target : {1.0, -0.5}) {
      CAPTURE(target);
      posed.qp.g *= target;
      const Solution& solution = solver.solve(problem, posed.qp.g, posed.qp.bounds, hold, kCap);
      CAPTURE(name(solution.status), solution.iterations);
      if (check_answer(posed, solution)) continue;
      if (unsolved++ == 0) first_unsolved = seed;
    }
  }
  CAPTURE(first, count, unsolved, first_unsolved);
  CHECK(unsolved * 1000 <= 5 * count);  // of twice as many solves
}

}  // namespace tendril::qp::fuzz_test
