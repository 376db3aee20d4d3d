// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

#include "qp/simd.h"

namespace tendril::qp {

inline constexpr int kMaxVariables = TENDRIL_MAX_ACTUATORS;
inline constexpr int kMaxRows = 64;  ///< of A: those of the actuators, and as many others
inline constexpr int kMaxConstraints = kMaxVariables + kMaxRows;  ///< two-sided: bounds of x and rows of A

using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxVariables, 1>;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxVariables, kMaxVariables>;
using RowVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxRows, 1>;
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxRows, kMaxVariables>;
/// Rounding error of a sum, relative to the sum of its terms' magnitudes.
inline constexpr double kRounding = 4e-16;
/// One number for each constraint, and then one for each row of E, padded to whole SIMD vectors: see Metric.
using Values = std::array<double, kMaxConstraints + kMaxVariables>;

/// The matrices of a quadratic program with n variables and r rows.
struct ProblemData {
  const Matrix& H;              ///< n × n, symmetric; only its lower triangle is read
  const RowMatrix& A;           ///< r × n
  const RowVector& compliance;  ///< r, positive; the violation v_k of row k is weighed by 1/compliance_k
  const Matrix* E = nullptr;  ///< n × n, the energy matrix, if it is needed and is not the first n rows of A
};

/// The constraints of a quadratic program with Hessian H in the metric of H⁻¹: the data of its dual.
///
/// Constraints are numbered 0..n-1 (the variables) and first_row()..first_row()+r-1 (the rows of A).
/// first_row() is n rounded up to a whole SIMD vector. The numbers between belong to no constraint; their
/// values are zero everywhere. C = [I; A] stacks the constraints. Each one is scaled by a weight ω_k, a power
/// of two so that scaling never rounds, which brings the diagonal of
///
///     G = Ω C H⁻¹ Cᵀ Ω     ((n + r) × (n + r))
///
/// to about 1. In scaled terms z = Ω_box x and γ = Ω_box⁻¹ g, the point where the Lagrangian with multipliers
/// λ is stationary has the constraint values Ω C x = -G (λ + [γ; 0]). An active-set method needs only G.
/// Q = [Ω_box⁻¹ H Ω_box⁻¹; Ω_row A Ω_box⁻¹] serves to check candidates. If the energy matrix E is not the
/// first n rows of A, E Ω_box⁻¹ follows in Q.
///
/// Row k has a softness δ_k, far below G_kk. It makes G_WW + Δ_WW positive definite for every set W of
/// constraints, also where rows are dependent. The iteration corrects the error that this causes
/// (dual_iteration.h).
class Metric {
 public:
  /// How the rows' softness is chosen.
  enum class Softness {
    kUniform,       // the same for all rows, as small as rounding allows: for rows that can be met
    kByCompliance,  // δ_k ∝ ω_k² c_k: where rows conflict, Σ v_k² / c_k over their violations v is least
  };

  /// Takes over a problem's matrices, in place of the previous ones.
  /// @param L  n × n, lower Cholesky factor of D H D, or of D H D plus a small term
  /// @param d  n, the diagonal of D, powers of two
  /// @param softness  that of the rows
  /// @return    false where the weights overflow
  /// Real-time: no (O((n + r)² n) operations, allocates nothing; meant for the model thread).
  bool build(const ProblemData& data, const Matrix& L, const Vector& d, Softness softness) noexcept;

  /// Number of variables.
  int n() const { return n_; }
  /// Number of rows of A.
  int rows() const { return rows_; }
  /// Number of the constraint that is row 0 of A.
  int first_row() const { return first_row_; }
  /// Number of the i-th constraint of C, i = 0..n+r-1: a variable, then a row.
  int number(int i) const { return i < n_ ? i : first_row_ + i - n_; }
  /// One more than the largest number of a constraint, rounded up to two SIMD vectors. Length of a column of
  /// G.
  int stride() const { return stride_; }
  /// Column of G for constraint k, stride() values.
  const double* gram(int k) const { return gram_.data() + k * stride_; }
  /// Column j of Q, j = 0..n-1.
  const double* q(int j) const { return q_.data() + j * q_stride_; }
  /// Where E z begins in Q z: at first_row(), or at stride() if E is not the first n rows of A.
  int first_energy_row() const { return first_energy_row_; }
  /// ω_k for constraint k, as an array. After stride(): 1, for the rows of E.
  const double* weight() const { return weight_.data(); }
  double weight(int k) const { return weight_[k]; }
  /// 1 / ω_k, exactly.
  const double* unit() const { return unit_.data(); }
  double unit(int k) const { return unit_[k]; }
  /// δ_k; 0 for variables, since their bounds are hard.
  double softness(int k) const { return softness_[k]; }
  /// Bounds what rounding, softness and the small term in L falsify: at the point that G gives for (λ, γ),
  /// each entry of the gradient of the Lagrangian, and each constraint's value, is off by at most this times
  /// Σ|λ_k| + Σ|γ_j|. Measured on H, A and G as they are.
  double error() const { return error_; }

  /// Q z, and for each of its sums the sum of the terms' magnitudes.
  /// @param z  n values
  /// Real-time: yes, 2n multiplications for each row of Q.
  void evaluate(const Values& z, Values& product, Values& size) const noexcept;

 private:
  void fill_q(const ProblemData& data);
  double measure_error() const;

  int n_ = 0, rows_ = 0, first_row_ = 0, first_energy_row_ = 0, stride_ = 0, q_stride_ = 0;
  double error_ = 0;
  alignas(64) Values weight_{}, unit_{}, softness_{};
  alignas(64) std::array<double, (kMaxConstraints + kMaxVariables) * kMaxVariables> q_{};
  alignas(64) std::array<double, kMaxConstraints * kMaxConstraints> gram_{};
};

/// The power of two nearest to a positive value, in the logarithm.
double power_of_two_near(double value) noexcept;

}  // namespace tendril::qp
