// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "tests/qp/random_problem.h"

namespace tendril::qp {

/// The solution of the problem exactly as its doubles state it, by CGAL's QP_solver, which the paper used, in
/// arithmetic without rounding; present where CGAL is (TENDRIL_HAS_CGAL).
/// H has to be positive semidefinite without any rounding: CGAL does not check it and then answers anything.
struct ExactSolution {
  Vector x;              // rounded to doubles
  double objective = 0;  // at the exact x, rounded once

  /// @return  empty where no point meets bounds and rows
  /// @throws std::runtime_error where the objective has no minimum
  static std::optional<ExactSolution> of(const Qp& qp);
};

}  // namespace tendril::qp
