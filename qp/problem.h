// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "qp/metric.h"

namespace tendril::qp {

/// Result of Problem::prepare.
enum class Preparation {
  kReady,
  kBadSize,       // sizes differ, are zero, or are larger than kMaxVariables or kMaxRows
  kNotFinite,     // NaN or infinity, or entries so far apart that scaling overflows
  kNotSymmetric,  // H or E differs from its transpose by more than 1e-8 of √(diagonal · diagonal)
  kIndefinite,  // H or E has a negative eigenvalue that rounding does not explain, or a row of A that is not
                // zero has a compliance that is not positive
};

/// One sentence for a log; static storage.
/// Real-time: yes.
const char* name(Preparation preparation) noexcept;

/// Which of several solutions is taken, where H is singular.
enum class TieBreak {
  kAny,          ///< any one
  kLeastEnergy,  ///< the one with the least ½ xᵀE x, at no expense of the objective
};

/// The part of the quadratic program that depends on the snapshot alone, ready for any g and bounds:
///
///     min ½ xᵀH x + gᵀx   s.t.   lower ≤ x ≤ upper,   row_lower ≤ A x ≤ row_upper.
///
/// For a robot whose rows are the displacements of its actuators, with effector weights D [Largilliere 2015,
/// eqs. 5-6, plus weights and SOFA's energy term; docs/derivation.md, (D53) to (D58)]:
///
///     H = W_eaᵀ D W_ea + ε κ W_aa,   A = E = W_aa.
///
/// A value of about 200 KiB, of which a solve reads some 100 n² bytes; fill it in place.
class Problem {
 public:
  /// Takes over a snapshot's H and W_aa, in place of the previous one. A = E = W_aa: the rows are the
  /// displacements of the actuators.
  /// @param H     n × n, symmetric positive semidefinite, objective unit / x unit²; n = 1..kMaxVariables
  /// @param W_aa  n × n, symmetric positive semidefinite, row unit / x unit
  /// @param tie_break  kLeastEnergy makes a problem of two levels: least objective first, then least energy
  /// @return   kReady, or why not; if not, solve() returns kIllPosed until the next success
  /// Real-time: no (about 9 n³ multiplications; allocates nothing). Meant for the model thread.
  Preparation prepare(const Matrix& H, const Matrix& W_aa, TieBreak tie_break = TieBreak::kAny) noexcept;

  /// The same with rows of any kind and number.
  /// @param H  n × n, as above
  /// @param E  n × n, symmetric positive semidefinite, energy unit / x unit²: energy matrix of the actuators
  /// @param A  r × n, row unit / x unit; r = 0..kMaxRows
  /// @param compliance  r, row unit² / energy unit; positive where the row is not zero. If rows conflict,
  ///     Σ v_k² / compliance_k over their violations v is made least. If a generalised force F_k of row k
  ///     alone moves it by c F_k, then c is its compliance, and v² / c is twice the work of a violation v. A
  ///     row that the actuators move by less than 1e-2 of that (A_k E⁻¹ A_kᵀ < 1e-4 c) makes the weights
  ///     inexact
  /// @return   as above
  /// Real-time: as above.
  Preparation prepare(const Matrix& H, const Matrix& E, const RowMatrix& A, const RowVector& compliance,
                      TieBreak tie_break = TieBreak::kAny) noexcept;

  /// Number of variables; 0 where nothing is prepared.
  int n() const { return n_; }
  /// Number of rows of A; 0 where nothing is prepared.
  int rows() const { return n_ == 0 ? 0 : objective_metric_.rows(); }
  /// Different for each successful prepare() of this process, shared by copies; 0 where nothing is prepared.
  uint64_t id() const { return n_ == 0 ? 0 : id_; }
  /// True for a problem of one level where H is singular or nearly so: then objective_metric() is that of
  /// H + μ D⁻², D ≈ diag(H)^-½, μ = 1e-6.
  bool proximal() const { return proximal_; }
  /// Whether the least energy is asked for, too.
  bool two_levels() const { return energy_weight_ > 0; }
  /// η of a problem of two levels, whose objective_metric() is that of H + η E; else 0. Where E is singular
  /// on the null space of H, or nearly so, as if two actuators were alike, E contains a term ≤ 1e-2 of
  /// its diagonal: they share the effort.
  double energy_weight() const { return energy_weight_; }
  /// The constraints in the metric of H, in which the optimum is sought.
  const Metric& objective_metric() const { return objective_metric_; }
  /// The constraints in the metric of D⁻², well conditioned, in which the least violation of rows that
  /// conflict is sought.
  const Metric& violation_metric() const { return violation_metric_; }

 private:
  Preparation factorize_one_level(const Matrix& H, const Vector& d, Matrix& L);
  Preparation factorize_two_levels(const Vector& d, Matrix& H, Matrix& E, Matrix& L);

  int n_ = 0;
  bool proximal_ = false;
  double energy_weight_ = 0;
  uint64_t id_ = 0;
  Metric objective_metric_, violation_metric_;
};

}  // namespace tendril::qp
