// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "fem/body/constraints.h"
#include "fem/sparse/factor.h"

namespace tendril::fem {

/// The linearised body seen at its actuators and effectors, near a pose x_i and its efforts λ_i [Largilliere
/// 2015, eqs. 3 and 4]:
///   δ_a = W_aa λ + δ_a_free,    p_e = W_ea λ + p_e_free.
/// λ are total efforts. The free values are those of the linearisation at efforts of zero. The paper's
/// δ_e_free is p_e_free minus the desired position, which may change without a new Compliance.
struct Compliance {
  Eigen::MatrixXd W_ea;          ///< e × m, m/N (m³/Pa and mixtures where there are cavities)
  Eigen::MatrixXd W_aa;          ///< m × m, in the same units, symmetric positive semidefinite
  Eigen::VectorXd delta_a_free;  ///< m, m or m³
  Eigen::VectorXd p_e_free;      ///< e, m or m³
};

/// The border B of K near one pose. Its c rows are those of J_a, those of J_e (if effectors are included),
/// and rᵀ with the residual r. [K Bᵀ; B 0] is the bordered matrix whose elimination gives W = B K⁻¹ Bᵀ.
class Border {
 public:
  enum class Rows { kActuators, kActuatorsAndEffectors };

  /// Keeps a reference to the constraints.
  /// @param nodes  number of nodes N of K
  /// Real-time: no (allocates).
  Border(const Constraints& constraints, int nodes, Rows rows);

  int rows() const { return m_ + e_ + 1; }  ///< c
  /// For each row the nodes at which it may be nonzero.
  std::vector<std::vector<int>> nodes() const;

  /// Computes J at the pose x (3N, m) and takes the residual r (3N, N).
  void set(const Eigen::VectorXd& x, const Eigen::VectorXd& r);
  /// r ← r + J_aᵀ λ.
  void add_efforts(const Eigen::VectorXd& lambda);
  /// Bᵀ, 3N × c: the columns J_aᵀ, J_eᵀ, r.
  const Eigen::MatrixXd& transposed() const { return transposed_; }

  /// Parts of W = B K⁻¹ Bᵀ (c × c): W_aa, m × m, and J_a K⁻¹ r, m entries.
  auto W_aa(const Eigen::MatrixXd& W) const { return W.topLeftCorner(m_, m_); }
  auto delta_a_of_r(const Eigen::MatrixXd& W) const { return W.col(m_ + e_).head(m_); }

  /// The compliance at the pose x (3N, m) of the last set(); requires Rows::kActuatorsAndEffectors.
  /// [Largilliere 2015, eqs. 3-4]
  /// @param W  B K⁻¹ Bᵀ, c × c
  /// Real-time: no; allocates nothing once `compliance` has its sizes.
  void compliance(const Eigen::MatrixXd& W, const Eigen::VectorXd& x, Compliance& compliance) const;

 private:
  const Constraints& constraints_;
  int m_, e_;  // e_ = 0 where effectors are not asked about
  Eigen::MatrixXd transposed_;
};

/// The response of a body to its actuators near one pose. K is factored together with the border B of J_a,
/// J_e and rᵀ, r = f + f_ext. So one factorisation gives W = J K⁻¹ Jᵀ and J K⁻¹ r, and one more substitution
/// K⁻¹(r + J_aᵀλ).
class Response {
 public:
  /// Keeps a reference to the constraints.
  /// @param pattern  a matrix of the pattern of K, made with the constraints' cliques
  /// Real-time: no (allocates).
  Response(const Constraints& constraints, const StiffnessMatrix& pattern, Border::Rows rows);

  /// Factors K with J at x.
  /// @param K  tangent, N/m
  /// @param x  3N, m
  /// @param r  residual f + f_ext, 3N, N
  /// @return   false if K is not positive definite; nothing below may be used then
  /// Real-time: no (time depends on the mesh); allocates nothing.
  [[nodiscard]] bool compute(const StiffnessMatrix& K, const Eigen::VectorXd& x, const Eigen::VectorXd& r);

  auto W_aa() const { return border_.W_aa(factor_.border_compliance()); }
  auto delta_a_of_r() const { return border_.delta_a_of_r(factor_.border_compliance()); }

  /// Border::compliance(), at the pose x of the last compute().
  void compliance(const Eigen::VectorXd& x, Compliance& compliance) const {
    border_.compliance(factor_.border_compliance(), x, compliance);
  }

  /// Solves for Newton's step dx = K⁻¹ (r + J_aᵀ λ).
  /// @param lambda  m, N or Pa
  /// @param dx      overwritten, 3N, m
  /// Real-time: no (time depends on the mesh); allocates nothing once dx has its size.
  void solve_step(const Eigen::VectorXd& lambda, Eigen::VectorXd& dx);

 private:
  Border border_;
  Factor factor_;
  Eigen::VectorXd coefficients_;  // of the border's rows
};

}  // namespace tendril::fem
