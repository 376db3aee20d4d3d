// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "qp/energy_passes.h"
#include "qp/refinement.h"
#include "qp/scaled_problem.h"
#include "qp/working_set.h"

namespace tendril::qp {

/// The dual active-set method in one metric, warm-started from the working set of the problem before.
///
/// Multipliers of the right sign move to the maximum of the dual on the face of the working set. One that
/// would change its sign leaves the set. At the maximum the most violated constraint enters.  [Goldfarb &
/// Idnani 1983; Arnström, Bemporad & Axehill 2022] The softness of the rows makes the dual strictly concave
/// on every face, so each full step increases it and no working set returns. Duplicated rows and degenerate
/// vertices need no special treatment. Refinement corrects the error of the softness.
///
/// Real-time, all: yes.
class DualIteration {
 public:
  /// kConflict: the rows cannot all be met, or so it seems from how slowly their violations change.
  enum class Outcome { kSolved, kConflict, kCapped };

  /// Takes over the gradient of a problem.
  /// @param metric  n variables
  /// @param g       n values
  void set_gradient(const Metric& metric, const Vector& g) noexcept;
  /// Shortcut if no constraint was active at the last solve: whether the minimum of the objective alone meets
  /// all constraints, and is known to be accurate. If so, unconstrained_minimum() is the solution.
  /// @param bounds  false where they contradict each other, or g is not finite
  bool unconstrained_is_optimal(const Metric& metric, const Bounds& bounds) const noexcept;
  /// The minimum of the objective alone: n scaled variables, after set_gradient().
  const Values& unconstrained_minimum() const { return problem_.start(); }
  /// Takes over the bounds, to iterate. The working set stays, except for constraints that are unbounded now.
  /// @param id             equal for equal metrics
  /// @param energy_weight  Problem::energy_weight()
  /// @return  false where g is not finite or bounds contradict each other or are not numbers
  bool set_bounds(const Metric& metric, uint64_t id, const Bounds& bounds, double energy_weight) noexcept;

  /// Iterates until the problem is solved or the rows appear to conflict.
  /// @param metric      that of set_gradient()
  /// @param settled     the rows conflict where their violations change by at most this from one candidate
  ///                    to the next, relative to the largest; a negative value: never
  /// @param iterations  counts on from its value
  /// @param cap         at which value of `iterations` to stop
  Outcome run(const Metric& metric, double settled, int& iterations, int cap) noexcept;

  /// For a problem of two levels, after kSolved: whether the candidate is the solution of the least energy.
  /// If not, prepares the next pass.
  bool energy_is_least(const Metric& metric) noexcept;

  /// Moves the bounds that row k passes by `violation`, in scaled terms; an equality stays one. Then
  /// drop_corrections().
  void relax(int k, double violation) noexcept { problem_.relax(k, violation); }
  /// Takes back the corrections of the rows, which grow without limit while rows conflict.
  void drop_corrections() noexcept;

  /// By how much the last candidate passes the bounds of constraint k, signed and scaled.
  double violation(int k) const;
  /// The constraints' values at the last candidate, scaled.
  const Values& values() const { return candidate_.values; }
  /// The last candidate: n scaled variables, within their bounds.
  const Values& z() const { return refinement_.z(); }
  /// The variables at the present multipliers, n scaled values within their bounds; a candidate or not.
  Values current_primal(const Metric& metric) noexcept;
  /// γ as it was given, n values.
  const Values& gamma() const { return energy_passes_.gamma(problem_); }
  /// The scaled multiplier of constraint k.
  double multiplier(int k) const;
  /// Empties the working set.
  void reset();

 private:
  void warm_start(const Metric& metric, uint64_t id);
  void add(const Metric& metric, int k);
  void drop(int i);
  double bound(int i) const;
  int step_multipliers();
  void update_values(const Metric& metric);
  int most_violated() const;

  WorkingSet working_set_;
  uint64_t id_ = 0;  // of the metric for which working_set_ is factored
  ScaledProblem problem_;
  Refinement refinement_;
  EnergyPasses energy_passes_;
  Candidate candidate_;
};

}  // namespace tendril::qp
