// SPDX-License-Identifier: Apache-2.0
#include "fem/body/equilibrium.h"

namespace tendril::fem {
namespace {

// Largest displacement of a node in one step, as a share of the body's diagonal: large enough not to slow a
// converging iteration, small enough that elements are not inverted.
constexpr double kMaxStep = 0.05;
// How often a step that inverted an element is halved.
constexpr int kHalvings = 8;

double body_diagonal(const Mesh& mesh) {
  return (mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff()).norm();
}

std::variant<Response, ReusedResponse> make_response(const Constraints& constraints, const StiffnessMatrix& K,
                                                     LinearSolverKind solver) {
  if (solver == LinearSolverKind::kReused) return ReusedResponse(constraints, K);
  return Response(constraints, K, Border::Rows::kActuatorsAndEffectors);
}

}  // namespace

Equilibrium::Equilibrium(const Model& model, const Constraints& constraints, LinearSolverKind solver)
    : model_(model),
      constraints_(constraints),
      K_(model.make_stiffness(constraints.cliques())),
      assembler_(model, K_),
      max_step_(kMaxStep * body_diagonal(model.mesh())),
      response_(make_response(constraints, K_, solver)),
      x_(model.rest()),
      previous_x_(x_) {}

void Equilibrium::set_x(const Eigen::VectorXd& x) {
  x_ = previous_x_ = x;
  usable_ = false;
}

LinearisationStatus Equilibrium::linearise(const Eigen::VectorXd& lambda, Tangent tangent) {
  usable_ = false;
  if (!lambda.allFinite()) return LinearisationStatus::kDiverged;
  if (!x_.allFinite()) x_ = previous_x_;
  LinearisationStatus status = linearise_here(lambda, tangent);
  for (int k = 0; status == LinearisationStatus::kDiverged && k < kHalvings; ++k) {
    x_ = 0.5 * (x_ + previous_x_);
    status = linearise_here(lambda, tangent);
  }
  usable_ = status == LinearisationStatus::kUsable;
  return status;
}

LinearisationStatus Equilibrium::linearise_here(const Eigen::VectorXd& lambda, Tangent wanted) {
  for (const Tangent tangent : {Tangent::kExact, Tangent::kSemidefinite}) {
    if (tangent == Tangent::kExact && wanted != tangent) continue;
    const int inverted = assembler_.assemble(x_, tangent, r_, K_);
    if (inverted > 0 || !r_.allFinite()) return LinearisationStatus::kDiverged;
    r_ += model_.external_forces();
    constraints_.add_stiffness(x_, lambda, tangent, K_);
    if (!compute_response(lambda)) continue;
    tangent_ = tangent;
    std::visit([&](const auto& response) { response.compliance(x_, compliance_); }, response_);
    return LinearisationStatus::kUsable;
  }
  return LinearisationStatus::kNotPositiveDefinite;
}

bool Equilibrium::compute_response(const Eigen::VectorXd& lambda) {
  if (auto* reused = std::get_if<ReusedResponse>(&response_)) return reused->compute(K_, x_, r_, lambda);
  return std::get<Response>(response_).compute(K_, x_, r_);
}

double Equilibrium::advance(const Eigen::VectorXd& lambda) {
  if (!usable_) return 0;
  std::visit([&](auto& response) { response.solve_step(lambda, dx_); }, response_);
  previous_x_ = x_;
  const double newton_step =
      dx_.reshaped(3, model_.free_nodes()).colwise().norm().maxCoeff<Eigen::PropagateNaN>();
  x_ += std::min(1.0, max_step_ / newton_step) * dx_;
  return newton_step;
}

/// Whether the iteration has reached a stable equilibrium. Only a factorisation shows it: if the last pose
/// had none, the next one will.
bool Equilibrium::converged(double step, double tolerance) {
  if (!(step <= tolerance)) return false;
  auto* reused = std::get_if<ReusedResponse>(&response_);
  if (!reused || reused->factored()) return tangent_ == Tangent::kExact;
  reused->discard_factor();
  return false;
}

EquilibriumResult Equilibrium::settle_under_efforts(const Eigen::VectorXd& lambda, double tolerance,
                                                    int iterations) {
  const Eigen::VectorXd start = x_;
  EquilibriumResult result{false, 0, 0, lambda};
  while (!result.converged && result.iterations++ < iterations) {
    if (linearise(lambda) != LinearisationStatus::kUsable) break;
    result.last_step = advance(lambda);
    result.converged = converged(result.last_step, tolerance);
  }
  if (!result.converged) set_x(start);
  return result;
}

EquilibriumResult Equilibrium::settle_at_displacements(const Eigen::VectorXd& delta_a, EffortSign sign,
                                                       double tolerance, int iterations) {
  const Eigen::VectorXd start = x_;
  Eigen::ArrayX<bool> pull_only = constraints_.pull_only();
  if (sign == EffortSign::kBilateral) pull_only.setConstant(false);
  EquilibriumResult result{false, 0, 0, Eigen::VectorXd::Zero(constraints_.actuators())};
  while (!result.converged && result.iterations++ < iterations) {
    if (linearise(result.lambda) != LinearisationStatus::kUsable) break;
    if (!solve_efforts(compliance_.W_aa, compliance_.delta_a_free, delta_a, pull_only, result.lambda)) break;
    result.last_step = advance(result.lambda);
    result.converged = converged(result.last_step, tolerance);
  }
  if (!result.converged) set_x(start);
  return result;
}

}  // namespace tendril::fem
