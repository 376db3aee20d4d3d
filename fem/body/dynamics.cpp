// SPDX-License-Identifier: Apache-2.0
#include "fem/body/dynamics.h"

#include "fem/body/imposed_displacement.h"

namespace tendril::fem {

Dynamics::Dynamics(const Model& model, const Constraints& constraints, const Damping& damping)
    : model_(model),
      constraints_(constraints),
      damping_(damping),
      A_(model.make_stiffness(constraints.cliques())),
      assembler_(model, A_),
      response_(constraints, A_, Border::Rows::kActuators) {
  reset(model.rest());
}

void Dynamics::reset(const Eigen::VectorXd& x) {
  x_ = x;
  v_.setZero(model_.unknowns());
  lambda_.setZero(constraints_.actuators());
}

double Dynamics::kinetic_energy() const { return 0.5 * v_.dot(model_.masses().cwiseProduct(v_)); }

bool Dynamics::step(const Eigen::VectorXd& delta_a, double h) {
  if (!compute_response(h)) return false;
  W_ = h * response_.W_aa();
  constraints_.displacement(x_, delta_a_free_);
  delta_a_free_ += h * response_.delta_a_of_r();
  next_lambda_ = lambda_;
  if (!solve_efforts(W_, delta_a_free_, delta_a, constraints_.pull_only(), next_lambda_)) return false;

  response_.solve_step(next_lambda_, v_);
  x_ += h * v_;
  lambda_ = next_lambda_;
  return true;
}

/// The response with A instead of K: its step is then the velocity v⁺.
bool Dynamics::compute_response(double h) {
  for (const Tangent tangent : {Tangent::kExact, Tangent::kSemidefinite}) {
    if (assembler_.assemble(x_, tangent, r_, A_) > 0) return false;
    r_ += model_.external_forces() + model_.masses().cwiseProduct(v_) / h;
    if (!r_.allFinite()) return false;
    constraints_.add_stiffness(x_, lambda_, tangent, A_);
    A_.scale(damping_.stiffness + h);
    A_.add_diagonal((1 / h + damping_.mass) * model_.masses());
    if (response_.compute(A_, x_, r_)) return true;
  }
  return false;
}

}  // namespace tendril::fem
