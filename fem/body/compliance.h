#pragma once

#include <Eigen/Core>

#include "fem/body/constraints.h"
#include "fem/sparse/factor.h"

namespace tendril::fem {

/// The body as its actuators and effectors see it near one pose x_i [Largilliere 2015, eqs. 3 and 4]:
///   δ_a = W_aa λ + δ_a_free,    p_e = W_ea λ + p_e_free.
/// It is the tangent at the pose and its efforts; the free values are where that tangent puts efforts of
/// zero. δ_e_free is p_e_free less the desired position, which may change without a new Compliance.
struct Compliance {
  Eigen::MatrixXd W_ea;          ///< e × m, m/N (m³/Pa and mixtures where there are cavities)
  Eigen::MatrixXd W_aa;          ///< m × m, in the same units, symmetric positive semidefinite
  Eigen::VectorXd delta_a_free;  ///< m, m or m³
  Eigen::VectorXd p_e_free;      ///< e, m or m³
};

/// What is asked of K near one pose, as a border of it: the rows of J_a, those of J_e where effectors are
/// asked about, and a residual r.
class Border {
 public:
  enum class Rows { kActuators, kActuatorsAndEffectors };

  /// Keeps a reference to the constraints.
  /// @param nodes  of K, N
  /// Real-time: no (allocates).
  Border(const Constraints& constraints, int nodes, Rows rows);

  int rows() const { return m_ + e_ + 1; }
  /// For each row the nodes at which it may be nonzero.
  std::vector<std::vector<int>> nodes() const;

  /// Takes J at x, and r (3N, N).
  void set(const Eigen::VectorXd& x, const Eigen::VectorXd& r);
  /// r ← r + J_aᵀ λ.
  void add_efforts(const Eigen::VectorXd& lambda);
  /// 3N × rows: J_aᵀ, J_eᵀ, r.
  const Eigen::MatrixXd& transposed() const { return transposed_; }

  /// Parts of W = B K⁻¹ Bᵀ: W_aa, m × m, and J_a K⁻¹ r, m entries.
  auto W_aa(const Eigen::MatrixXd& W) const { return W.topLeftCorner(m_, m_); }
  auto delta_a_of_r(const Eigen::MatrixXd& W) const { return W.col(m_ + e_).head(m_); }

  /// W and the free values at the pose x of the last set().  [Largilliere 2015, eqs. 3-4]
  /// Asks for Rows::kActuatorsAndEffectors. Allocates nothing once `compliance` has its sizes.
  void compliance(const Eigen::MatrixXd& W, const Eigen::VectorXd& x, Compliance& compliance) const;

 private:
  const Constraints& constraints_;
  int m_, e_;  // e_ = 0 where effectors are not asked about
  Eigen::MatrixXd transposed_;
};

/// How a body answers to its actuators near one pose: the factor of K with the rows of J_a, J_e and r = f +
/// f_ext as its border, so that W = J K⁻¹ Jᵀ and J K⁻¹ r come out of one factorisation, and K⁻¹(r + J_aᵀλ)
/// costs one substitution more.
class Response {
 public:
  /// Keeps a reference to the constraints.
  /// @param pattern  a matrix of the pattern of K, made with the constraints' cliques
  /// Real-time: no (allocates).
  Response(const Constraints& constraints, const StiffnessMatrix& pattern, Border::Rows rows);

  /// Factors K with J at x.
  /// @param K  tangent, N/m
  /// @param r  forces out of balance, 3N, N
  /// @return   false if K is not positive definite; nothing below may be used then
  /// Real-time: no (time depends on the mesh); allocates nothing.
  [[nodiscard]] bool compute(const StiffnessMatrix& K, const Eigen::VectorXd& x, const Eigen::VectorXd& r);

  auto W_aa() const { return border_.W_aa(factor_.border_compliance()); }
  auto delta_a_of_r() const { return border_.delta_a_of_r(factor_.border_compliance()); }

  /// As Border::compliance(), at the pose x of the last compute().
  void compliance(const Eigen::VectorXd& x, Compliance& compliance) const {
    border_.compliance(factor_.border_compliance(), x, compliance);
  }

  /// dx = K⁻¹ (r + J_aᵀ λ), 3N.
  /// Real-time: no (time depends on the mesh); allocates nothing once dx has its size.
  void solve_step(const Eigen::VectorXd& lambda, Eigen::VectorXd& dx);

 private:
  Border border_;
  Factor factor_;
  Eigen::VectorXd coefficients_;  // of the border's rows
};

}  // namespace tendril::fem
