// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "qp/dual_iteration.h"
#include "qp/problem.h"

namespace tendril::qp {

/// How a solve ended.
enum class Status {
  kOptimal,   // x solves the problem: its optimality conditions were checked against H and A
  kSoftened,  // the rows cannot be met within lower ≤ x ≤ upper; x violates them least
  kCapped,    // stopped at the iteration cap; x is no worse than the last command
  kIllPosed,  // not a number, contradictory bounds, no prepared Problem; x is the last command, clipped
};

/// One word for a log; static storage.
/// Real-time: yes.
const char* name(Status status) noexcept;

struct Solution {
  Vector x;
  Status status = Status::kIllPosed;
  int iterations = 0;
  double row_violation = 0;  // by how much A x passes the bound that it passes most, in the rows' unit; 0 for
                             // kOptimal, which means less than what is promised there
};

/// Bounds the work of a solve: floating-point operations, whatever the numbers. At most all
/// constraints are in the working set; sizes are rounded up as in Metric.
/// @param rows  of A, and n more where E is not the first n of them
/// Real-time: yes.
constexpr double worst_case_operations(int variables, int rows, int iteration_cap) {
  const double n = round_up_to_simd(variables), k = n + round_up_to_simd(rows);
  const double product = 2 * n * k;         // with [Q] or with n columns of G
  const double step = 2 * k * k + 4 * k;    // both substitutions, and the step
  const double values = 2 * k * k + 4 * k;  // G λ, and the most violated
  const double update = 2 * k * k + 4 * k;  // of the factor: a constraint comes or goes
  const double check = 2 * product + 4 * n * k + 2 * n * n + product + 20 * n;  // residuals, and correction
  const double begin = product + k * k * k / 3 + 20 * n;  // g, and the factor for another snapshot
  return 2 * begin + iteration_cap * (step + (update > values + check ? update : values + check)) +
         5 * product;
}

/// Solves a sequence of problems, each from the working set of the one before; one object a thread.
class Solver {
 public:
  /// Solves one problem.  [Largilliere 2015, eqs. 5-6; the method: dual_iteration.h]
  /// @param problem  prepared; n variables, 1..kMaxVariables, r rows, 0..kMaxRows
  /// @param g        n, objective unit / x unit
  /// @param bounds   n and r values; see Bounds
  /// @param hold     n, the last command, in x's unit: the fallback; may be the x of the last Solution
  /// @param iteration_cap  largest number of iterations, of all stages together. From the working set of
  ///     a cycle ago one to five is usual, from nothing about 2n; 10n nearly always suffices, and 16n
  ///     where rows conflict
  /// @return  valid until the next call. Whatever the arguments, x is finite, and lower ≤ x ≤ upper holds
  ///     exactly unless these bounds contradict each other. By status:
  ///   - kOptimal: each row is met to 1e-9 of (Σ_j |A_kj x_j| + |its bound|), or to 1e-8 of s √(A H⁻¹ A)_kk,
  ///     where s = max_j |x_j| / √H⁻¹_jj is the size of x in the metric of H⁻¹, or to 1e-7 where H is so
  ///     nearly singular that rounding forbids more; so is the gradient, to n 1e-8 of s, or of max_j |g_j|
  ///     √H⁻¹_jj where rounding forbids more. Of a problem of two levels (TieBreak) x is found by passes; the
  ///     last changed W_ea x, with H = W_eaᵀW_ea, by at most 1e-7 of itself, or it was the twelfth
  ///   - kSoftened: Σ_k v_k² / c_k over the rows' violations v is least, c_k being the row's compliance (v² /
  ///   c_k
  ///     is twice the work of a force that moves row k alone by v); x is optimal for the rows relaxed by v
  ///   - kCapped: no row is violated more than at the clipped `hold`, up to rounding; where that met the
  ///     rows, the objective is not higher than there
  ///   - kIllPosed: x is `hold`, clipped; entries of it that are not finite count as 0
  /// Real-time: yes; at most worst_case_operations() floating-point operations. The same calls give the same
  /// bits.
  const Solution& solve(const Problem& problem, const Vector& g, const Bounds& bounds, const Vector& hold,
                        int iteration_cap) noexcept;

  /// Multiplier of a constraint at the last solve of a problem of one level that ended kOptimal or kSoftened:
  /// with c_k the rows of C = [I; A], H x + g + Σ_k multiplier(k) c_k = 0. Positive at an upper bound,
  /// negative at a lower one, else zero.
  /// @param problem  that of the last solve
  /// @param k        0..n+r-1: row of C
  /// @return         objective unit / unit of the constraint
  /// Real-time: yes.
  double multiplier(const Problem& problem, int k) const noexcept;

  /// Forgets the working set, as if no problem had been solved yet.
  /// Real-time: yes.
  void reset() noexcept;

 private:
  const Solution& iterate(const Problem& problem, const Bounds& bounds, const Vector& hold, int cap);
  DualIteration::Outcome run(const Problem& problem, const Bounds& bounds, int cap, bool& softened);
  bool find_least_violation(const Problem& problem, const Bounds& bounds, int cap,
                            DualIteration::Outcome& outcome);
  const Solution& finish(const Problem& problem, const Bounds& bounds, const Vector& hold, const Values& z,
                         Status status);
  static double worst_violation(const Metric& metric, const Bounds& bounds, const Values& values);
  const Solution& feasible_fallback(const Problem& problem, const Bounds& bounds, const Vector& hold);
  const Solution& ill_posed_result(const Problem& problem, const Bounds& bounds, const Vector& hold);

  DualIteration optimum_, least_violation_;
  Solution solution_;
};

}  // namespace tendril::qp
