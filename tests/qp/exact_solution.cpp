// SPDX-License-Identifier: Apache-2.0
#include "tests/qp/exact_solution.h"

#include <CGAL/Gmpzf.h>
#include <CGAL/QP_functions.h>
#include <CGAL/QP_models.h>

#include <cmath>
#include <stdexcept>

namespace tendril::qp {

std::optional<ExactSolution> ExactSolution::of(const Qp& qp) {
  const int n = static_cast<int>(qp.g.size());
  CGAL::Quadratic_program<double> program(CGAL::SMALLER, false, 0, false, 0);
  int next_row = 0;
  const auto add_row = [&](int k, CGAL::Comparison_result relation, double bound) {
    if (std::isinf(bound)) return;
    for (int j = 0; j < n; ++j) program.set_a(j, next_row, qp.A(k, j));
    program.set_b(next_row, bound);
    program.set_r(next_row++, relation);
  };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i <= j; ++i) program.set_d(j, i, qp.H(j, i));
    program.set_c(j, qp.g[j]);
    program.set_l(j, std::isfinite(qp.bounds.lower[j]), qp.bounds.lower[j]);
    program.set_u(j, std::isfinite(qp.bounds.upper[j]), qp.bounds.upper[j]);
  }
  for (int k = 0; k < qp.rows(); ++k) {
    add_row(k, CGAL::LARGER, qp.bounds.row_lower[k]);
    add_row(k, CGAL::SMALLER, qp.bounds.row_upper[k]);
  }
  const auto solution = CGAL::solve_quadratic_program(program, CGAL::Gmpzf());
  if (solution.is_infeasible()) return std::nullopt;
  if (!solution.is_optimal()) throw std::runtime_error("the objective has no minimum");
  ExactSolution result{Vector(n), CGAL::to_double(solution.objective_value())};
  int j = 0;
  for (auto value = solution.variable_values_begin(); value != solution.variable_values_end(); ++value)
    result.x[j++] = CGAL::to_double(*value);
  return result;
}

}  // namespace tendril::qp
