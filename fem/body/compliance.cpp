// SPDX-License-Identifier: Apache-2.0
#include "fem/body/compliance.h"

#include <numeric>

namespace tendril::fem {

Border::Border(const Constraints& constraints, int nodes, Rows rows)
    : constraints_(constraints),
      m_(constraints.actuators()),
      e_(rows == Rows::kActuators ? 0 : constraints.effector_coordinates()),
      transposed_(Eigen::MatrixXd::Zero(3 * nodes, m_ + e_ + 1)) {}

std::vector<std::vector<int>> Border::nodes() const {
  std::vector<std::vector<int>> result = constraints_.actuator_nodes();
  if (e_ > 0)
    for (auto& list : constraints_.effector_nodes()) result.push_back(std::move(list));
  result.emplace_back(transposed_.rows() / 3);
  std::iota(result.back().begin(), result.back().end(), 0);
  return result;
}

void Border::set(const Eigen::VectorXd& x, const Eigen::VectorXd& r) {
  constraints_.actuator_directions(x, transposed_.leftCols(m_));
  if (e_ > 0) constraints_.effector_directions(x, transposed_.middleCols(m_, e_));
  transposed_.col(m_ + e_) = r;
}

void Border::add_efforts(const Eigen::VectorXd& lambda) {
  for (int a = 0; a < m_; ++a) transposed_.col(m_ + e_) += lambda[a] * transposed_.col(a);
}

void Border::compliance(const Eigen::MatrixXd& W, const Eigen::VectorXd& x, Compliance& compliance) const {
  compliance.W_aa = W_aa(W);
  compliance.W_ea = W.block(m_, 0, e_, m_);
  constraints_.displacement(x, compliance.delta_a_free);
  compliance.delta_a_free += delta_a_of_r(W);
  constraints_.effector_position(x, compliance.p_e_free);
  compliance.p_e_free += W.col(m_ + e_).segment(m_, e_);
}

Response::Response(const Constraints& constraints, const StiffnessMatrix& pattern, Border::Rows rows)
    : border_(constraints, pattern.nodes(), rows),
      factor_(pattern, border_.nodes()),
      coefficients_(Eigen::VectorXd::Unit(border_.rows(), border_.rows() - 1)) {}

bool Response::compute(const StiffnessMatrix& K, const Eigen::VectorXd& x, const Eigen::VectorXd& r) {
  border_.set(x, r);
  return factor_.factorize(K, border_.transposed());
}

void Response::solve_step(const Eigen::VectorXd& lambda, Eigen::VectorXd& dx) {
  coefficients_.head(lambda.size()) = lambda;
  dx.resize(border_.transposed().rows());
  factor_.solve(coefficients_, dx);
}

}  // namespace tendril::fem
