#include "fem/dynamics.h"

#include "fem/imposed_displacement.h"

namespace tendril::fem {

Dynamics::Dynamics(const Model& model, const Constraints& constraints, const Damping& damping)
    : model_(model),
      constraints_(constraints),
      damping_(damping),
      A_(model.make_stiffness(constraints.cliques())),
      assembler_(model, A_),
      factor_(A_) {
  reset(model.rest());
}

void Dynamics::reset(const Eigen::VectorXd& x) {
  x_ = x;
  v_.setZero(model_.unknowns());
  lambda_.setZero(constraints_.actuators());
}

double Dynamics::kinetic_energy() const { return 0.5 * v_.dot(model_.masses().cwiseProduct(v_)); }

bool Dynamics::step(const Eigen::VectorXd& delta_a, double h) {
  bool factored = false;
  for (const Tangent tangent : {Tangent::kExact, Tangent::kSemidefinite}) {
    if (assembler_.assemble(x_, tangent, f_, A_) > 0 || !f_.allFinite()) return false;
    constraints_.add_stiffness(x_, lambda_, tangent, A_);
    A_.scale(damping_.stiffness + h);
    A_.add_diagonal((1 / h + damping_.mass) * model_.masses());
    factored = factor_.factorize(A_);
    if (factored) break;
  }
  if (!factored) return false;

  // With A in the place of K the responses are velocities.
  f_ += model_.external_forces() + model_.masses().cwiseProduct(v_) / h;
  solve_responses(constraints_, x_, factor_, f_, responses_);
  const auto m = constraints_.actuators();
  const Eigen::MatrixXd W = h * responses_.loads.leftCols(m).transpose() * responses_.moves;
  const Eigen::VectorXd free = constraints_.displacement(x_) + W.col(m);
  Eigen::VectorXd lambda = lambda_;
  if (!solve_efforts(W.leftCols(m), free, delta_a, constraints_.pull_only(), lambda)) return false;

  v_ = responses_.moves.leftCols(m) * lambda + responses_.moves.col(m);
  x_ += h * v_;
  lambda_ = lambda;
  return true;
}

}  // namespace tendril::fem
