#pragma once

#include <Eigen/Core>
#include <variant>

#include "fem/body/assembler.h"
#include "fem/body/compliance.h"
#include "fem/body/constraints.h"
#include "fem/body/imposed_displacement.h"
#include "fem/body/model.h"
#include "fem/body/reused_response.h"

namespace tendril::fem {

/// How a linearisation ended.
enum class LinearisationStatus {
  kUsable,
  kNotPositiveDefinite,  ///< K cannot be factored, not even its semidefinite part
  kDiverged,             ///< positions are not finite, or elements are inside out
};

/// How the response to the actuators is found: with a factorisation at each pose, or with one that is reused
/// for many, which is the faster way with large meshes and small steps.
enum class LinearSolverKind { kDirect, kReused };

/// What an iteration toward equilibrium came to.
struct EquilibriumResult {
  bool converged;  ///< at rest, and stable: the exact tangent is positive definite there
  int iterations;
  double last_step;        ///< largest displacement of a node in the last iteration, m
  Eigen::VectorXd lambda;  ///< efforts at the end, N or Pa
};

/// The quasi-static body: a pose x that follows the efforts by Newton's method, one response serving both the
/// step and the compliance [Largilliere 2015, eqs. 1 to 4 and step 7 of the loop].
///
/// linearise() then advance() is one refresh of the model thread; the settle functions repeat it until x
/// rests.
class Equilibrium {
 public:
  /// Starts at rest. Keeps references to the model and the constraints.
  Equilibrium(const Model& model, const Constraints& constraints,
              LinearSolverKind solver = LinearSolverKind::kDirect);

  const Eigen::VectorXd& x() const { return x_; }  ///< 3N, m
  /// Places the body; linearise() is to be called before it moves on.
  void set_x(const Eigen::VectorXd& x);

  /// Assembles K at x under the efforts λ (their own stiffness included), factors it or solves with it, and
  /// computes the compliance. Where the exact tangent is not positive definite, as it may be away from
  /// equilibrium, the semidefinite one serves. Where the last step went too far, into a pose that is inside
  /// out, it is halved until it did not.
  /// @param lambda  m, N or Pa
  /// @param tangent  kSemidefinite to use that one always; steps then converge slower than Newton's
  /// @return  kDiverged also where λ is not finite
  /// Real-time: no (time depends on the mesh).
  LinearisationStatus linearise(const Eigen::VectorXd& lambda, Tangent tangent = Tangent::kExact);

  /// Compliance at the last pose linearised.
  const Compliance& compliance() const { return compliance_; }

  /// x ← x + K⁻¹ (f + f_ext + J_aᵀ λ) with the response of the last linearise(), shortened where a node would
  /// move too far at once. Where that call did not say kUsable, or x has been set since, x stays where it is.
  /// @return  the largest displacement of a node that Newton's step newton_step for, m; 0 where x stays
  double advance(const Eigen::VectorXd& lambda);

  /// Equilibrium under given efforts. Where it does not converge, x is what it was before.
  /// @param tolerance  largest displacement of a node at which the iteration ends, m
  EquilibriumResult settle_under_efforts(const Eigen::VectorXd& lambda, double tolerance,
                                         int iterations = 100);

  /// Equilibrium with actuators at given displacements δ_a (m entries, m or m³). It must be stable under its
  /// efforts as well: a cavity that is inflated beyond the largest pressure it can bear is not found,
  /// although its volume would hold it. Where it does not converge, x is what it was before.
  EquilibriumResult settle_at_displacements(const Eigen::VectorXd& delta_a, EffortSign sign, double tolerance,
                                            int iterations = 100);

 private:
  LinearisationStatus linearise_here(const Eigen::VectorXd& lambda, Tangent wanted);
  bool compute_response(const Eigen::VectorXd& lambda);
  bool converged(double step, double tolerance);

  const Model& model_;
  const Constraints& constraints_;
  StiffnessMatrix K_;
  Assembler assembler_;
  double max_step_;                    // m: Newton's steps are cut to this
  Tangent tangent_ = Tangent::kExact;  // the one that served last
  bool usable_ = false;                // response_ belongs to the pose from which x_ is to move on
  std::variant<Response, ReusedResponse> response_;
  Eigen::VectorXd x_, previous_x_, r_, dx_;  // previous_x_: x before the last step
  Compliance compliance_;
};

}  // namespace tendril::fem
