#pragma once

#include <Eigen/Core>
#include <vector>

#include "fem/body/compliance.h"
#include "fem/body/node_rotations.h"

namespace tendril::fem {

/// The same answers as Response, for bodies so large that factoring K at each pose takes too long: one factor
/// serves many poses, as the preconditioner of a few steps of the conjugate gradient method [Hestenes &
/// Stiefel 1952; Saad, "Iterative Methods for Sparse Linear Systems" (2003), ch. 9].
///
/// With L Lᵀ = K at the pose that was factored, and R the rotations by which the body around each node has
/// turned since, P = R L Lᵀ Rᵀ stands near K. K X = Bᵀ is solved for the rows of J_a, J_e and for the forces
/// out of balance, eight at a time and each for itself, from the last pose's solutions turned along, until
/// rᵀP⁻¹r, which stands for the squared error in the norm of K, is small. W then has the square of that
/// error:
///   W = B X + Xᵀ(Bᵀ − K X) + (Bᵀ − K X)ᵀ P⁻¹ (Bᵀ − K X).
///
/// K is factored anew where that is the cheaper way on, by counts of operations and not by a clock, so that
/// the same poses take the same course at every run, and where K shows that it is not positive definite. A
/// pose that was not factored may have an indefinite K all the same.
class ReusedResponse {
 public:
  /// Largest error of a solution in the norm of K, as a share of the solution; W has about its square.
  static constexpr double kTolerance = 0.01;

  /// Keeps a reference to the constraints.
  /// @param pattern  a matrix of the pattern of K, made with the constraints' cliques
  /// Real-time: no (allocates).
  ReusedResponse(const Constraints& constraints, const StiffnessMatrix& pattern);

  /// Solves with K, or factors it, with J at x.
  /// @param K       tangent, N/m
  /// @param r       forces out of balance but for the actuators', 3N, N
  /// @param lambda  efforts at which the pose is, m, N or Pa; near them solve_step() is most accurate
  /// @return        false if K is not positive definite; nothing below may be used then
  /// Real-time: no (time depends on the mesh); allocates nothing.
  [[nodiscard]] bool compute(const StiffnessMatrix& K, const Eigen::VectorXd& x, const Eigen::VectorXd& r,
                             const Eigen::VectorXd& lambda);

  bool factored() const { return factored_; }   ///< the last compute() factored K: it is positive definite
  int sweeps() const { return sweeps_; }        ///< of the last compute(), with P and K over eight vectors
  void discard_factor() { reusable_ = false; }  ///< the next compute() factors K

  /// As Border::compliance(), at the pose x of the last compute().
  void compliance(const Eigen::VectorXd& x, Compliance& compliance) const {
    border_.compliance(W_, x, compliance);
  }

  /// dx = K⁻¹ (r + J_aᵀ λ), 3N.
  /// Real-time: no (time depends on the mesh); allocates nothing once dx has its size.
  void solve_step(const Eigen::VectorXd& lambda, Eigen::VectorXd& dx);

 private:
  using EightNumbers = Eigen::Array<double, 8, 1>;
  /// Eight of the right sides; those that are too many are zero.
  struct RhsBlock {
    EightVectors B, X, R, Z;  // Bᵀ, solutions, residuals, P⁻¹R
    Eigen::Array<bool, 8, 1> unchecked = Eigen::Array<bool, 8, 1>::Constant(false);  // one step is enough
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
  double factorization_cost_;  // of a factorisation, in sweeps
  bool reusable_ = false, factored_ = false;
  int sweeps_ = 0;
  // Since the last factorisation.
  double sweeps_since_factorization_ = 0;  // sweeps, the factorisation included
  int poses_since_factorization_ = 0;
  int poses_to_skip_ = 0,
      backoff_ = 0;  // poses that are to be factored without trying, and how many next time
};

}  // namespace tendril::fem
