// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fem/body/compliance.h"
#include "fem/body/node_rotations.h"

namespace tendril::fem {

/// The response of a body whose K takes too long to factor at each pose. The factor of an earlier pose is the
/// preconditioner of a few iterations of the conjugate gradient method [Hestenes & Stiefel 1952; Saad,
/// "Iterative Methods for Sparse Linear Systems" (2003), ch. 9].
///
/// L Lᵀ = K at the pose that was factored. The body around each node has rotated since; R holds these
/// rotations. P = R L Lᵀ Rᵀ is then near K. K X = Bᵀ is solved for the rows of J_a, J_e and for r + J_aᵀλ,
/// eight right-hand sides at a time, from the rotated solutions of the last pose. An iteration ends when
/// rᵀP⁻¹r of its residual, an estimate of the squared error in the norm of K, is small; that of r + J_aᵀλ is
/// not checked. With Y = Bᵀ − K X,
///   W = B X + XᵀY + YᵀP⁻¹Y.
/// Its error is Yᵀ(K⁻¹ − P⁻¹)Y, smaller than the squared error YᵀK⁻¹Y of the solutions while P is near K.
///
/// K is factored anew when that is the cheaper way, or when K turns out not to be positive definite. Counts
/// of operations decide and no clock, so the same poses give the same results in every run. At a pose that
/// was not factored, K may be indefinite and nothing shows it.
class ReusedResponse {
 public:
  /// At which estimated relative error of a solution, in the norm of K, its iteration ends.
  static constexpr double kTolerance = 0.01;

  /// Keeps a reference to the constraints.
  /// @param pattern  a matrix of the pattern of K, made with the constraints' cliques
  /// Real-time: no (allocates).
  ReusedResponse(const Constraints& constraints, const StiffnessMatrix& pattern);

  /// Solves with K, or factors it, with J at x. K must be of the pattern given at construction.
  /// @param K       tangent, N/m
  /// @param x       3N, m
  /// @param r       residual f + f_ext, 3N, N
  /// @param lambda  efforts of the pose, m, N or Pa; near them solve_step() is most accurate
  /// @return        false if K is not positive definite; nothing below may be used then
  /// Real-time: no (time depends on the mesh); allocates nothing.
  [[nodiscard]] bool compute(const StiffnessMatrix& K, const Eigen::VectorXd& x, const Eigen::VectorXd& r,
                             const Eigen::VectorXd& lambda);

  bool factored() const { return factored_; }  ///< the last compute() factored K: it is positive definite
  /// Products with P⁻¹ in the last compute(), of eight vectors each.
  int sweeps() const { return sweeps_; }
  void discard_factor() { reusable_ = false; }  ///< the next compute() factors K

  /// Border::compliance(), at the pose x of the last compute().
  void compliance(const Eigen::VectorXd& x, Compliance& compliance) const {
    border_.compliance(W_, x, compliance);
  }

  /// Newton's step dx = K⁻¹ (r + J_aᵀ λ), to the accuracy of the solutions.
  /// @param lambda  m, N or Pa
  /// @param dx      overwritten, 3N, m
  /// Real-time: no (time depends on the mesh); allocates nothing once dx has its size.
  void solve_step(const Eigen::VectorXd& lambda, Eigen::VectorXd& dx);

 private:
  using EightNumbers = Eigen::Array<double, 8, 1>;
  /// Eight right-hand sides; in the last block the unused ones are zero.
  struct RhsBlock {
    EightVectors B, X, R, Z;  // Bᵀ, solutions, residuals, P⁻¹R
    Eigen::Array<bool, 8, 1> unchecked = Eigen::Array<bool, 8, 1>::Constant(false);  // takes one step
  };

  bool should_factorize();
  bool solve_all(const StiffnessMatrix& K, const Eigen::VectorXd& x);
  bool solve_block(const StiffnessMatrix& K, RhsBlock& block);
  bool slower_than_factorizing(const RhsBlock& block, int steps, const EightNumbers& first,
                               const EightNumbers& rho, const EightNumbers& target) const;
  EightNumbers precondition(RhsBlock& block);
  void compute_W();
  bool factorize(const StiffnessMatrix& K, const Eigen::VectorXd& x);

  Border border_;
  Factor factor_;
  NodeRotations rotations_;  // from the pose that was factored
  Eigen::VectorXd factored_x_;
  std::vector<RhsBlock> blocks_;
  EightVectors P_, KP_;
  Eigen::MatrixXd W_;
  Eigen::VectorXd lambda_, coefficients_;
  double factorization_cost_;  // in sweeps
  bool reusable_ = false, factored_ = false;
  int sweeps_ = 0;
  double sweeps_since_factorization_ = 0;  // with the cost of the factorisation
  int poses_since_factorization_ = 0;
  int poses_to_skip_ = 0,
      backoff_ = 0;  // poses that are to be factored without trying, and how many next time
};

}  // namespace tendril::fem
