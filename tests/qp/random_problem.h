// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <random>

#include "qp/solver.h"

namespace tendril::qp {

inline constexpr double kInf = std::numeric_limits<double>::infinity();

/// A quadratic program as the caller states it.
struct Qp {
  Matrix H;
  RowMatrix A;  // square in random_qp(), where it is the energy matrix, too
  Vector g;
  Bounds bounds;

  double objective(const Vector& x) const { return 0.5 * x.dot(H * x) + g.dot(x); }
  /// Magnitude of the objective's terms at x, in which its errors are to be read.
  double scale(const Vector& x) const { return 0.5 * x.dot(H * x) + g.cwiseAbs().dot(x.cwiseAbs()); }
  int rows() const { return static_cast<int>(A.rows()); }
  /// By how much A x passes its bounds, signed, a value for each row.
  RowVector violation(const Vector& x) const;
  /// Magnitude of the terms of row k at x and of its bounds.
  double row_scale(const Vector& x, int k) const;
  /// Magnitude that g, by itself, gives row k.
  double row_response(int k) const;
};

enum class Rows { kFeasible, kArbitrary };

/// A random problem of the kind the controller poses, H = W_eaᵀW_ea + ε A and g = W_eaᵀd, with each of these
/// at random: ε = 0 and fewer effectors than actuators (H singular), duplicated actuators, equal bounds,
/// infinite sides, a bound exactly at the optimum's value, scales of x and of the rows from 1e-3 to 1e3.
/// @param rows  kFeasible: some point meets bounds and rows; kArbitrary: there may be none
Qp random_qp(std::mt19937_64& random, int n, Rows rows);

}  // namespace tendril::qp
