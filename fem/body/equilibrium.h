// SPDX-License-Identifier: Apache-2.0
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

/// How Equilibrium::linearise() ended.
enum class LinearisationStatus {
  kUsable,
  kNotPositiveDefinite,  ///< K cannot be factored, not even the semidefinite one
  kDiverged,             ///< positions or efforts are not finite, or elements are inverted
};

/// How linear systems with K are solved.
enum class LinearSolverKind {
  kDirect,  ///< K is factored at each pose
  kReused,  ///< one factor preconditions conjugate gradients at many poses: faster for large meshes and small
            ///< steps
};

/// Result of an iteration to equilibrium.
struct EquilibriumResult {
  bool converged;  ///< at rest, and stable: the exact tangent is positive definite there
  int iterations;
  double last_step;        ///< largest displacement of a node in the last iteration, m
  Eigen::VectorXd lambda;  ///< efforts at the end, m, N or Pa
};

/// The quasi-static body: a pose x that follows the efforts by Newton's method. The same response gives the
/// step and the compliance [Largilliere 2015, eqs. 1 to 4 and step 7 of the loop].
///
/// The sign of K differs from the paper's eq. 2, f(x + dx) ≈ f(x) + K dx. Here K = −∂(f + J_aᵀλ)/∂x, so that
/// K is positive definite at a stable equilibrium, and K also contains the stiffness of the efforts.
///
/// One refresh of the model thread is linearise(), then advance(). The settle functions repeat both until x
/// is at rest.
class Equilibrium {
 public:
  /// Starts at the shape of the mesh. Keeps references to the model and the constraints.
  /// Real-time: no (allocates).
  Equilibrium(const Model& model, const Constraints& constraints,
              LinearSolverKind solver = LinearSolverKind::kDirect);

  const Eigen::VectorXd& x() const { return x_; }  ///< 3N, m
  /// Sets the pose (3N, m). advance() then needs a linearise() first.
  void set_x(const Eigen::VectorXd& x);

  /// Assembles K at x under the efforts λ, solves with it, and computes the compliance.
  ///
  /// If the exact tangent is not positive definite, as may be away from equilibrium, the semidefinite one
  /// replaces it. If elements are inverted, the last step is halved until they are not, 8 times at most.
  /// @param lambda   m, N or Pa
  /// @param tangent  kSemidefinite to use that one always; steps then converge slower than Newton's
  /// @return         kDiverged also if λ is not finite
  /// Real-time: no (time depends on the mesh).
  LinearisationStatus linearise(const Eigen::VectorXd& lambda, Tangent tangent = Tangent::kExact);

  /// Compliance of the last linearise() that returned kUsable.
  const Compliance& compliance() const { return compliance_; }

  /// x ← x + τ K⁻¹ (f + f_ext + J_aᵀ λ), with the response of the last linearise(). τ ≤ 1 limits the
  /// displacement of each node to 5 % of the body's diagonal. x stays where it is unless that call returned
  /// kUsable, or if x has been set since.
  /// @param lambda  m, N or Pa
  /// @return        largest displacement of a node for τ = 1, m; 0 if x stays
  /// Real-time: no (time depends on the mesh).
  double advance(const Eigen::VectorXd& lambda);

  /// Iterates to the equilibrium under given efforts. If it does not converge, x is what it was before.
  /// @param lambda      m, N or Pa
  /// @param tolerance   largest displacement of a node at which the iteration ends, m
  /// @param iterations  at most so many
  /// Real-time: no.
  EquilibriumResult settle_under_efforts(const Eigen::VectorXd& lambda, double tolerance,
                                         int iterations = 100);

  /// Iterates to the equilibrium with the actuators at given displacements. If it does not converge, x is
  /// what it was before.
  ///
  /// The equilibrium must be stable under its efforts too. So a cavity that is inflated beyond its largest
  /// possible pressure is not found, although the held volume would be stable.
  /// @param delta_a     m, m or m³
  /// @param tolerance   largest displacement of a node at which the iteration ends, m
  /// @param iterations  at most so many
  /// Real-time: no.
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
  double max_step_;                    // of a node in one iteration, m
  Tangent tangent_ = Tangent::kExact;  // of the last linearise()
  bool usable_ = false;                // response_ is that of the pose x_
  std::variant<Response, ReusedResponse> response_;
  Eigen::VectorXd x_, previous_x_, r_, dx_;  // previous_x_: x before the last step
  Compliance compliance_;
};

}  // namespace tendril::fem
