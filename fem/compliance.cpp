#include "fem/compliance.h"

#include <numeric>

namespace tendril::fem {
namespace {

/// Nodes at which each row of J_a, J_e and r may be nonzero.
std::vector<std::vector<int>> border_nodes(const Constraints& constraints, bool effectors, int nodes) {
  std::vector<std::vector<int>> result = constraints.actuator_nodes();
  if (effectors)
    for (auto& list : constraints.effector_nodes()) result.push_back(std::move(list));
  result.emplace_back(nodes);
  std::iota(result.back().begin(), result.back().end(), 0);
  return result;
}

}  // namespace

Response::Response(const Constraints& constraints, const StiffnessMatrix& pattern, Rows rows)
    : constraints_(constraints),
      m_(constraints.actuators()),
      e_(rows == Rows::kActuators ? 0 : constraints.effector_coordinates()),
      factor_(pattern, border_nodes(constraints, rows != Rows::kActuators, pattern.nodes())),
      border_(pattern.size(), m_ + e_ + 1),
      coefficients_(Eigen::VectorXd::Unit(m_ + e_ + 1, m_ + e_)) {}

bool Response::compute(const StiffnessMatrix& K, const Eigen::VectorXd& x, const Eigen::VectorXd& r) {
  constraints_.actuator_directions(x, border_.leftCols(m_));
  if (e_ > 0) constraints_.effector_directions(x, border_.middleCols(m_, e_));
  border_.col(m_ + e_) = r;
  return factor_.factorize(K, border_);
}

void Response::compliance(const Eigen::VectorXd& x, Compliance& compliance) const {
  const Eigen::MatrixXd& W = factor_.border_compliance();
  compliance.W_aa = W_aa();
  compliance.W_ea = W.block(m_, 0, e_, m_);
  constraints_.displacement(x, compliance.delta_a_free);
  compliance.delta_a_free += delta_a_of_r();
  constraints_.effector_position(x, compliance.p_e_free);
  compliance.p_e_free += W.col(m_ + e_).segment(m_, e_);
}

void Response::move(const Eigen::VectorXd& lambda, Eigen::VectorXd& dx) {
  coefficients_.head(m_) = lambda;
  dx.resize(border_.rows());
  factor_.solve(coefficients_, dx);
}

}  // namespace tendril::fem
