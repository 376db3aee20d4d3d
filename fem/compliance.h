#pragma once

#include <Eigen/Core>

#include "fem/constraints.h"
#include "fem/factor.h"

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

/// How a body answers to its actuators near one pose: the factor of K with the rows of J_a, J_e and r = f +
/// f_ext as its border, so that W = J K⁻¹ Jᵀ and J K⁻¹ r come out of one factorisation, and K⁻¹(r + J_aᵀλ)
/// costs one substitution more.
class Response {
 public:
  /// What is asked about.
  enum class Rows { kActuators, kActuatorsAndEffectors };

  /// Keeps a reference to the constraints.
  /// @param pattern  a matrix of the pattern of K, made with the constraints' cliques
  /// Real-time: no (allocates).
  Response(const Constraints& constraints, const StiffnessMatrix& pattern, Rows rows);

  /// Factors K with J at x.
  /// @param K  tangent, N/m
  /// @param r  forces out of balance, 3N, N
  /// @return   false if K is not positive definite; nothing below may be used then
  /// Real-time: no (time depends on the mesh); allocates nothing.
  [[nodiscard]] bool compute(const StiffnessMatrix& K, const Eigen::VectorXd& x, const Eigen::VectorXd& r);

  /// W_aa, m × m, and J_a K⁻¹ r, m entries.
  auto W_aa() const { return factor_.border_compliance().topLeftCorner(m_, m_); }
  auto delta_a_of_r() const { return factor_.border_compliance().col(m_ + e_).head(m_); }

  /// W and the free values at the pose x of the last compute().  [Largilliere 2015, eqs. 3-4]
  /// Asks for Rows::kActuatorsAndEffectors. Real-time: no; allocates nothing once `compliance` has its sizes.
  void compliance(const Eigen::VectorXd& x, Compliance& compliance) const;

  /// dx = K⁻¹ (r + J_aᵀ λ), 3N.
  /// Real-time: no (time depends on the mesh); allocates nothing once dx has its size.
  void move(const Eigen::VectorXd& lambda, Eigen::VectorXd& dx);

 private:
  const Constraints& constraints_;
  int m_, e_;  // e_ = 0 where effectors are not asked about
  Factor factor_;
  Eigen::MatrixXd border_;        // 3N × (m + e + 1): J_aᵀ, J_eᵀ, r
  Eigen::VectorXd coefficients_;  // of the border's rows
};

}  // namespace tendril::fem
