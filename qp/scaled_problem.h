// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "qp/problem.h"

namespace tendril::qp {

/// What changes with every cycle. Any side may be infinite, equal sides are an equality.
struct Bounds {
  Vector lower, upper;             // of x, n values each, in its unit
  RowVector row_lower, row_upper;  // of A x, r values each, in its unit
};

/// Gradient and bounds of one cycle in the scaled terms of a Metric.
/// Real-time, all: yes.
class ScaledProblem {
 public:
  /// Takes over the gradient.
  /// @param metric  n variables
  /// @param g       n values
  void set_gradient(const Metric& metric, const Vector& g) noexcept;

  /// Takes over the bounds. Of the metric of set_gradient().
  /// @return  false where g is not finite or bounds contradict each other or are not numbers
  bool set_bounds(const Metric& metric, const Bounds& bounds) noexcept;

  /// Whether the minimum of the objective alone, start(), meets these bounds; false where they contradict
  /// each other, or g is not finite.
  bool minimum_meets(const Metric& metric, const Bounds& bounds) const noexcept;

  /// Adds this to γ, and moves start() accordingly.
  /// @param change  n values
  void add_to_gamma(const Metric& metric, const Values& change) noexcept;
  /// Moves start() to where it is for a γ that is larger by this; γ stays.
  /// @param change  n values
  void correct_gradient(const Metric& metric, const Values& change) noexcept;
  /// Adds this to start() of the rows k..k+3.
  void correct_rows(int k, Simd change) { store(&start_[k], load(&start_[k]) + change); }

  /// Moves the bounds that row k passes by `violation`, in scaled terms; an equality stays one.
  void relax(int k, double violation) noexcept;

  int n() const { return n_; }
  int rows() const { return rows_; }
  /// As in Metric.
  int first_row() const { return first_row_; }
  int stride() const { return stride_; }
  /// γ, the scaled g, with what was added: n values; max |γ_j| and Σ |γ_j|.
  const Values& gamma() const { return gamma_; }
  double gamma_max() const { return gamma_max_; }
  double gamma_sum() const { return gamma_sum_; }
  /// Values of the constraints at λ = 0, with the corrections so far.
  const Values& start() const { return start_; }
  /// Largest magnitude of a value of start() that was moved to its bounds.
  double value_max() const { return value_max_; }
  /// Scaled bounds, as far as relaxed.
  const Values& lower() const { return lower_; }
  const Values& upper() const { return upper_; }
  /// Magnitude of what the bounds of row k were relaxed by. The relaxed bound is exact to its rounding.
  double relaxation(int k) const { return relaxed_ ? relaxation_[k] : 0; }

 private:
  int n_ = 0, rows_ = 0, first_row_ = 0, stride_ = 0;
  double gamma_max_ = 0, gamma_sum_ = 0, value_max_ = 0;
  bool relaxed_ = false;
  alignas(64) Values gamma_{}, start_{}, lower_{}, upper_{}, relaxation_{};
};

/// By how much a value is outside its bounds, signed.
inline double bound_violation(double value, double lower, double upper) {
  return value < lower ? value - lower : value > upper ? value - upper : 0;
}

inline Simd bound_violation(Simd value, Simd lower, Simd upper) {
  return min(value - lower, Simd{}) + max(value - upper, Simd{});
}

}  // namespace tendril::qp
