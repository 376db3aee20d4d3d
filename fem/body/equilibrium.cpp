#include "fem/body/equilibrium.h"

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

std::variant<Response, ReusedResponse> make_response(const Constraints& constraints, const StiffnessMatrix& K,
                                                     Solver solver) {
  if (solver == Solver::kReused) return ReusedResponse(constraints, K);
  return Response(constraints, K, Border::Rows::kActuatorsAndEffectors);
}

}  // namespace

Equilibrium::Equilibrium(const Model& model, const Constraints& constraints, Solver solver)
    : model_(model),
      constraints_(constraints),
      K_(model.make_stiffness(constraints.cliques())),
      assembler_(model, K_),
      longest_move_(kLongestMove * body_diagonal(model.mesh())),
      response_(make_response(constraints, K_, solver)),
      x_(model.rest()),
      before_(x_) {}

void Equilibrium::set_x(const Eigen::VectorXd& x) {
  x_ = before_ = x;
  usable_ = false;
}

Pose Equilibrium::linearise(const Eigen::VectorXd& lambda, Tangent tangent) {
  usable_ = false;
  if (!lambda.allFinite()) return Pose::kDiverged;
  if (!x_.allFinite()) x_ = before_;
  Pose pose = linearise_here(lambda, tangent);
  for (int k = 0; pose == Pose::kDiverged && k < kHalvings; ++k) {
    x_ = 0.5 * (x_ + before_);
    pose = linearise_here(lambda, tangent);
  }
  usable_ = pose == Pose::kUsable;
  return pose;
}

Pose Equilibrium::linearise_here(const Eigen::VectorXd& lambda, Tangent wanted) {
  for (const Tangent tangent : {Tangent::kExact, Tangent::kSemidefinite}) {
    if (tangent == Tangent::kExact && wanted != tangent) continue;
    const int inverted = assembler_.assemble(x_, tangent, r_, K_);
    if (inverted > 0 || !r_.allFinite()) return Pose::kDiverged;
    r_ += model_.external_forces();
    constraints_.add_stiffness(x_, lambda, tangent, K_);
    if (!respond(lambda)) continue;
    tangent_ = tangent;
    std::visit([&](const auto& response) { response.compliance(x_, compliance_); }, response_);
    return Pose::kUsable;
  }
  return Pose::kNotPositiveDefinite;
}

bool Equilibrium::respond(const Eigen::VectorXd& lambda) {
  if (auto* reused = std::get_if<ReusedResponse>(&response_)) return reused->compute(K_, x_, r_, lambda);
  return std::get<Response>(response_).compute(K_, x_, r_);
}

double Equilibrium::advance(const Eigen::VectorXd& lambda) {
  if (!usable_) return 0;
  std::visit([&](auto& response) { response.move(lambda, dx_); }, response_);
  before_ = x_;
  const double asked = dx_.reshaped(3, model_.free_nodes()).colwise().norm().maxCoeff<Eigen::PropagateNaN>();
  x_ += std::min(1.0, longest_move_ / asked) * dx_;
  return asked;
}

/// Whether an iteration has come to a stable equilibrium. Only a factorisation can tell: where the last pose
/// had none, the next one will.
bool Equilibrium::at_rest(double move, double tolerance) {
  if (!(move <= tolerance)) return false;
  auto* reused = std::get_if<ReusedResponse>(&response_);
  if (!reused || reused->factored()) return tangent_ == Tangent::kExact;
  reused->forget();
  return false;
}

Settled Equilibrium::settle_under_efforts(const Eigen::VectorXd& lambda, double tolerance, int iterations) {
  const Eigen::VectorXd start = x_;
  Settled result{false, 0, 0, lambda};
  while (!result.converged && result.iterations++ < iterations) {
    if (linearise(lambda) != Pose::kUsable) break;
    result.last_move = advance(lambda);
    result.converged = at_rest(result.last_move, tolerance);
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
    result.converged = at_rest(result.last_move, tolerance);
  }
  if (!result.converged) set_x(start);
  return result;
}

}  // namespace tendril::fem
