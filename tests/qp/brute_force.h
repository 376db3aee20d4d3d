// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "tests/qp/random_problem.h"

namespace tendril::qp {

/// A solution found by trying the active sets one after the other, smallest first, until one fulfils the
/// Karush-Kuhn-Tucker conditions; as the problem is convex it is then solved. The work grows as 9ⁿ.
/// @return  empty where no active set does: the problem is infeasible
/// @param fixed   rows that x must meet exactly beside the problem's own, c × n, linearly independent
/// @param values  c, what they must come to
std::optional<Vector> solve_by_brute_force(const Qp& qp, const Eigen::MatrixXd& fixed = {},
                                           const Eigen::VectorXd& values = {});

}  // namespace tendril::qp
