#pragma once

#include <Eigen/Core>
#include <array>

#include "qp/strip.h"

namespace tendril::qp {

inline constexpr int kMaxVariables = 32;
inline constexpr int kMaxConstraints = 2 * kMaxVariables;  // two-sided: one a variable, one a row of A

using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxVariables, 1>;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxVariables, kMaxVariables>;
/// Of a sum, relative to the sum of its terms' magnitudes.
inline constexpr double kRounding = 4e-16;
/// One number a constraint, in whole strips: see Metric.
using Values = std::array<double, kMaxConstraints>;

/// The constraints of a quadratic program with Hessian H, seen in the metric of H⁻¹.
///
/// Constraints are numbered 0..n-1 (the variables) and first_row()..first_row()+n-1 (the rows of A),
/// first_row() being n rounded up to a whole strip; the numbers between stand for nothing and have zeros
/// everywhere. C = [I; A] stacks the constraints. Each is scaled by a weight ω_k, a power of two so that
/// scaling never rounds, which brings the diagonal of
///
///     G = Ω C H⁻¹ Cᵀ Ω     (2n × 2n)
///
/// to about 1. In scaled terms z = Ω_box x and γ = Ω_box⁻¹ g, the point where the Lagrangian with multipliers
/// λ is stationary has the constraint values Ω C x = -G (λ + [γ; 0]): G is all that an active-set method
/// needs. Beside it lies Q = [Ω_box⁻¹ H Ω_box⁻¹; Ω_row A Ω_box⁻¹], against which candidates are checked.
///
/// Row k has the softness δ_k, far below G_kk. It makes G_WW + Δ_WW positive definite for every set W of
/// constraints, also where rows are dependent; what it falsifies is put right by the iteration
/// (dual_iteration.h).
class Metric {
 public:
  /// How the rows' softness is chosen.
  enum class Softness {
    kEven,      // alike for all rows, as small as rounding allows: for rows that can be met
    kByEnergy,  // δ_k ∝ ω_k² A_kk: where rows conflict, Σ v_k² / A_kk over their violations v is least
  };

  /// Takes over a problem's matrices, in place of the previous ones.
  /// @param H  n × n, symmetric; only its lower triangle is read
  /// @param L  n × n, lower Cholesky factor of D H D, or of D H D plus a small term
  /// @param A  n × n, symmetric positive semidefinite
  /// @param d  n, the diagonal of D, powers of two
  /// @param softness  that of the rows
  /// @return    false where the weights overflow
  /// Real-time: bounded (about 8 n³ multiplications), allocates nothing.
  bool build(const Matrix& H, const Matrix& L, const Matrix& A, const Vector& d, Softness softness) noexcept;

  /// Number of variables.
  int n() const { return n_; }
  /// Number of the constraint that is row 0 of A.
  int first_row() const { return first_row_; }
  /// Number of the i-th constraint of C, i = 0..2n-1: a variable, then a row.
  int number(int i) const { return i < n_ ? i : first_row_ + i - n_; }
  /// Length of a column of G and of Q: 2 first_row().
  int stride() const { return 2 * first_row_; }
  /// Column of G for constraint k, stride() values.
  const double* gram(int k) const { return gram_.data() + k * stride(); }
  /// Column j of Q, j = 0..n-1, stride() values.
  const double* q(int j) const { return q_.data() + j * stride(); }
  /// ω_k for constraint k, as an array.
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
  /// Real-time: 4n² multiplications.
  void evaluate(const Values& z, Values& product, Values& size) const noexcept;

 private:
  double measure_error() const;

  int n_ = 0, first_row_ = 0;
  double error_ = 0;
  alignas(64) Values weight_{}, unit_{}, softness_{};
  alignas(64) std::array<double, kMaxConstraints * kMaxVariables> q_{};
  alignas(64) std::array<double, kMaxConstraints * kMaxConstraints> gram_{};
};

/// The power of two nearest to a positive value, in the logarithm.
double power_of_two_near(double value) noexcept;

}  // namespace tendril::qp
