// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "tests/qp/sequence.h"

namespace tendril::qp {

TEST_CASE("Recorded control cycles are solved to the objective of their reference", "[law]") {
  const auto files = sequence_files();
  if (files.empty()) {
    WARN("no recorded sequences in " TENDRIL_SHARED_DATA "/qp: skipped");
    SUCCEED();
    return;
  }
  for (const auto& file : files) {
    const Sequence sequence = read_sequence(file);
    std::vector<Problem> problems(sequence.snapshots.size());
    for (std::size_t i = 0; i < problems.size(); ++i)
      REQUIRE(problems[i].prepare(sequence.snapshots[i].H, sequence.snapshots[i].A) == Preparation::kReady);
    Solver solver;
    Vector hold = Vector::Zero(problems[0].n());
    double worst = 0;
    int most = 0;
    for (const Sequence::Tick& tick : sequence.ticks) {
      const Solution& solution = solver.solve(problems[tick.snapshot], tick.g, tick.bounds, hold, 400);
      CAPTURE(sequence.name, &tick - sequence.ticks.data(), solution.iterations, solution.row_violation);
      REQUIRE(solution.status == (tick.infeasible ? Status::kSoftened : Status::kOptimal));
      REQUIRE((solution.x.array() >= tick.bounds.lower.array()).all());
      REQUIRE((solution.x.array() <= tick.bounds.upper.array()).all());
      hold = solution.x;
      most = std::max(most, solution.iterations);
      if (tick.infeasible) continue;
      const Matrix& H = sequence.snapshots[tick.snapshot].H;
      const double objective = 0.5 * hold.dot(H * hold) + tick.g.dot(hold);
      const double error = std::abs(objective - tick.objective) / tick.scale;
      REQUIRE(error <= 1e-8);
      worst = std::max(worst, error);
    }
    CAPTURE(sequence.name, worst, most);
    CHECK(most <= 10 * problems[0].n());
  }
}

}  // namespace tendril::qp
