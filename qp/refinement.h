// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "qp/scaled_problem.h"
#include "qp/working_set.h"

namespace tendril::qp {

/// Accuracy of a row of an accepted candidate, relative to its terms.
inline constexpr double kRowAccuracy = 1e-9;

/// The point at the present multipliers.
struct Candidate {
  double term_sum = 0;          ///< Σ |γ_j| + Σ |λ_k|
  alignas(64) Values values{};  ///< of the constraints, scaled
};

/// Accepts a candidate of the dual iteration, or corrects the start of the next round by what it lacks.
///
/// Softness, the proximal term and rounding falsify a candidate. At each candidate H z, A z and the gradient
/// of the Lagrangian are evaluated in the data as given. If the residuals are too large, they are added to γ
/// and to the rows' values at λ = 0. For the equations this is iterative refinement, for the multipliers the
/// proximal method of multipliers [Rockafellar 1976]. If the rows conflict, their violations converge to the
/// least ones [Chiche & Gilbert 2016].
///
/// Real-time, all: yes.
class Refinement {
 public:
  /// kConflict: the rows cannot all be met, or so it seems from how slowly their violations change.
  enum class Result { kAccepted, kInexact, kConflict };

  /// Begins a new problem.
  /// @param energy_weight  Problem::energy_weight()
  void begin(const ScaledProblem& problem, double energy_weight) noexcept;
  /// To be called where the working set or γ has changed.
  void expect_new_gradient() { gradient_norm_ = std::numeric_limits<double>::infinity(); }

  /// Whether the candidate is accurate enough. Where its error is known to be little, and to change the
  /// objective little, its residuals are not evaluated.
  /// @param candidate  its rows' values are replaced by A z where it was evaluated and the result is not
  /// kInexact
  /// @param settled   the rows conflict where their violations change by at most this from one candidate to
  ///                  the next, relative to the largest; a negative value: never
  Result accept(const Metric& metric, const ScaledProblem& problem, const WorkingSet& working_set,
                Candidate& candidate, double settled) noexcept;

  /// Corrects the problem by the residuals of this candidate, the last one.
  void correct(const Metric& metric, ScaledProblem& problem, const Candidate& candidate) noexcept;
  /// Takes back the corrections of the rows, which grow without limit while rows conflict.
  void drop_corrections(ScaledProblem& problem) noexcept;

  /// The last candidate: n scaled variables, within their bounds.
  const Values& z() const { return z_; }
  /// Q z there, if it was evaluated.
  const Values& Qz() const { return Qz_; }

 private:
  enum class RowResult { kMet, kMissed, kConflict };

  // Not inlined: accept() is to save no registers for what is rarely needed.
  [[gnu::noinline]] Result accept_by_residuals(const Metric& metric, const ScaledProblem& problem,
                                               const WorkingSet& working_set, Candidate& candidate,
                                               double settled);
  void evaluate_residuals(const Metric& metric, const ScaledProblem& problem, const WorkingSet& working_set);
  RowResult check_rows(const Metric& metric, const ScaledProblem& problem, const WorkingSet& working_set,
                       const Candidate& candidate, double settled);
  bool stationary(const Metric& metric, const ScaledProblem& problem);

  double energy_weight_ = 0;
  double max_row_residual_ = 0;  // at the last candidate
  double gradient_norm_ = 0;     // of gradient_residual_, in the metric
  int stalls_ = 0;               // how often max_row_residual_ was more than half of the one before
  double objective_scale_ = 0;   // magnitude of the objective at the candidate
  alignas(64) Values z_{}, Qz_{};
  alignas(64) Values terms_{};  // sums of magnitudes: of Q z, and of the gradient of the Lagrangian
  alignas(64) Values gradient_residual_{};  // gradient of the Lagrangian at the candidate, n values
  alignas(64) Values row_residual_{};       // what the rows miss their bounds by
  alignas(64) Values row_correction_{};     // the rows' share of what start() was corrected by
};

}  // namespace tendril::qp
