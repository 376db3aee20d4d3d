#include "fem/equilibrium.h"

namespace tendril::fem {
namespace {

// Longest Newton step as a share of the body's diagonal: large enough not to slow a converging iteration,
// small enough that elements do not turn inside out on the way.
constexpr double kLongestMove = 0.05;
// How often a step that turned an element inside out is halved.
constexpr int kHalvings = 8;

double body_diagonal(const Mesh& mesh) {
  return (mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff()).norm();
}

}  // namespace

Equilibrium::Equilibrium(const Model& model, const Constraints& constraints)
    : model_(model),
      constraints_(constraints),
      K_(model.make_stiffness(constraints.cliques())),
      assembler_(model, K_),
      longest_move_(kLongestMove * body_diagonal(model.mesh())),
      response_(constraints, K_, Response::Rows::kActuatorsAndEffectors),
      x_(model.rest()),
      before_(x_) {}

void Equilibrium::set_x(const Eigen::VectorXd& x) {
  x_ = before_ = x;
  usable_ = false;
}

Pose Equilibrium::linearise(const Eigen::VectorXd& lambda) {
  usable_ = false;
  if (!lambda.allFinite()) return Pose::kDiverged;
  if (!x_.allFinite()) x_ = before_;
  Pose pose = linearise_here(lambda);
  for (int k = 0; pose == Pose::kDiverged && k < kHalvings; ++k) {
    x_ = 0.5 * (x_ + before_);
    pose = linearise_here(lambda);
  }
  usable_ = pose == Pose::kUsable;
  return pose;
}

Pose Equilibrium::linearise_here(const Eigen::VectorXd& lambda) {
  for (const Tangent tangent : {Tangent::kExact, Tangent::kSemidefinite}) {
    const int inverted = assembler_.assemble(x_, tangent, r_, K_);
    if (inverted > 0 || !r_.allFinite()) return Pose::kDiverged;
    r_ += model_.external_forces();
    constraints_.add_stiffness(x_, lambda, tangent, K_);
    if (!response_.compute(K_, x_, r_)) continue;
    tangent_ = tangent;
    response_.compliance(x_, compliance_);
    return Pose::kUsable;
  }
  return Pose::kNotPositiveDefinite;
}

double Equilibrium::advance(const Eigen::VectorXd& lambda) {
  if (!usable_) return 0;
  response_.move(lambda, dx_);
  before_ = x_;
  const double asked = dx_.reshaped(3, model_.free_nodes()).colwise().norm().maxCoeff<Eigen::PropagateNaN>();
  x_ += std::min(1.0, longest_move_ / asked) * dx_;
  return asked;
}

Settled Equilibrium::settle_under_efforts(const Eigen::VectorXd& lambda, double tolerance, int iterations) {
  const Eigen::VectorXd start = x_;
  Settled result{false, 0, 0, lambda};
  while (!result.converged && result.iterations++ < iterations) {
    if (linearise(lambda) != Pose::kUsable) break;
    result.last_move = advance(lambda);
    result.converged = result.last_move <= tolerance && stable();
  }
  if (!result.converged) set_x(start);
  return result;
}

Settled Equilibrium::settle_at_displacements(const Eigen::VectorXd& delta_a, Sign sign, double tolerance,
                                             int iterations) {
  const Eigen::VectorXd start = x_;
  Eigen::ArrayX<bool> pull_only = constraints_.pull_only();
  if (sign == Sign::kBilateral) pull_only.setConstant(false);
  Settled result{false, 0, 0, Eigen::VectorXd::Zero(constraints_.actuators())};
  while (!result.converged && result.iterations++ < iterations) {
    if (linearise(result.lambda) != Pose::kUsable) break;
    if (!solve_efforts(compliance_.W_aa, compliance_.delta_a_free, delta_a, pull_only, result.lambda)) break;
    result.last_move = advance(result.lambda);
    result.converged = result.last_move <= tolerance && stable();
  }
  if (!result.converged) set_x(start);
  return result;
}

}  // namespace tendril::fem
