#pragma once

#include <cstdint>

#include "qp/problem.h"
#include "qp/working_set.h"

namespace tendril::qp {

/// What changes with every cycle; n values each. Any side may be infinite, equal sides are an equality.
struct Bounds {
  Vector lower, upper;          // of x, in its unit
  Vector row_lower, row_upper;  // of A x, in its unit
};

/// The dual active-set method in one metric, from the working set of the problem before.
///
/// Multipliers of the right sign move to the maximum of the dual on the face of the working set; one that
/// would change its sign leaves the set, and at the maximum the most violated constraint enters.  [Goldfarb &
/// Idnani 1983; Arnström, Bemporad & Axehill 2022] The softness of the rows makes the dual strictly concave
/// on every face, so each full step increases it, no working set returns, and duplicated rows and degenerate
/// vertices need no care.
///
/// What softness, the proximal term and rounding falsify is put right by measuring: at each candidate H z,
/// A z and the gradient of the Lagrangian are evaluated in the data as given, and the discrepancies are added
/// to γ and to the rows' values. This is iterative refinement and the proximal method of multipliers
/// [Rockafellar 1976] at once. Where the rows conflict, their violations converge to the least ones under it
/// [Chiche & Gilbert 2016].
///
/// Real-time, all: bounded, nothing allocates, throws or locks.
class DualIteration {
 public:
  /// kConflict: the rows cannot all be met, or so it seems from how slowly their violations change.
  enum class Outcome { kSolved, kConflict, kCapped };

  /// Takes over the gradient of a problem.
  /// @param metric  n variables
  /// @param g       n values
  void set_gradient(const Metric& metric, const Vector& g) noexcept;
  /// Where no constraint was active a problem ago, none often is: whether the minimum of the objective alone
  /// meets all constraints, and is known to be accurate; z() is this minimum then, and nothing is left to do.
  /// @param bounds  n values each; false where they contradict each other, or g is not finite
  bool free(const Metric& metric, const Bounds& bounds) noexcept;
  /// Takes over the bounds, to iterate; the working set stays, less what they rule out.
  /// @param id             equal for equal metrics
  /// @param energy_weight  Problem::energy_weight()
  /// @return  false where g is not finite or bounds contradict each other or are not numbers
  bool set_bounds(const Metric& metric, std::uint64_t id, const Bounds& bounds,
                  double energy_weight) noexcept;

  /// Iterates until the problem is solved or the rows appear to conflict.
  /// @param metric      that of set_gradient()
  /// @param settled     the rows conflict where their violations change by at most this from one candidate
  ///                    to the next, relative to the largest; a negative value: never
  /// @param iterations  counts on from its value
  /// @param cap         at which value of `iterations` to stop
  Outcome run(const Metric& metric, double settled, int& iterations, int cap) noexcept;

  /// For a problem of two levels, after kSolved: whether the candidate is the solution of the least energy.
  /// If not, shifts γ by the gradient of the objective there, so that the next one is nearer.
  bool least_energy(const Metric& metric) noexcept;

  /// Moves the bounds that row k passes by `violation`, in scaled terms; an equality stays one. Then
  /// settle().
  void relax(int k, double violation) noexcept;
  /// Takes back the corrections of the rows, which conflict had driven up.
  void settle() noexcept;

  /// By how much the last candidate passes the bounds of constraint k, signed and scaled.
  double violation(int k) const;
  /// The constraints' values at the last candidate, scaled.
  const Values& values() const { return value_; }
  /// The last candidate: n scaled variables, within their bounds.
  const Values& z() const { return z_; }
  /// The variables where the iteration stands, n scaled values within their bounds; a candidate or not.
  Values standing(const Metric& metric) noexcept;
  /// γ as it was given, n values.
  const Values& gamma() const { return passes_ > 0 ? gradient_ : gamma_; }
  /// The scaled multiplier of constraint k.
  double multiplier(int k) const;
  /// Empties the working set.
  void reset();

 private:
  enum class Verdict { kSolved, kInexact, kConflict };
  enum class Rows { kMet, kOff, kConflict };

  void resume(const Metric& metric, std::uint64_t id);
  void enter(const Metric& metric, int k);
  void leave(int i);
  double bound(int i) const;
  int move_multipliers();
  void update_values(const Metric& metric);
  int most_violated() const;
  Verdict judge(const Metric& metric, double settled);
  Verdict measure(const Metric& metric, double settled);
  Rows judge_rows(const Metric& metric, double settled, const Values& size, double worth);
  double reach(const Metric& metric, int k) const;
  bool stationary(const Metric& metric, const Values& size);
  void correct(const Metric& metric);
  void move_start(const Metric& metric, const Values& gamma);

  WorkingSet working_set_;
  std::uint64_t id_ = 0;
  int n_ = 0, first_row_ = 0;             // of the metric
  double largest_ = 0, terms_ = 0;        // max |γ_j|, Σ |γ_j|
  double all_terms_ = 0;                  // Σ |γ_j| + Σ |λ_k|
  double size_ = 0;                       // magnitude of the constraints' values at the start
  double worst_ = 0;                      // what the row that is off most was off at the last candidate
  double energy_weight_ = 0;              // of a problem of two levels, else 0
  int passes_ = 0;                        // towards the least energy
  double slope_length_ = 0;               // of the gradient there, in the metric
  int stalls_ = 0;                        // how often it was no less than half of that before
  alignas(64) Values lower_{}, upper_{};  // scaled bounds, as far as relaxed
  alignas(64) Values gradient_{};         // γ before the first pass
  alignas(64) Values gamma_{};            // γ, the scaled g
  alignas(64) Values start_{};            // the constraints' values at λ = 0, with the corrections so far
  alignas(64) Values shift_{};            // the rows' share of these corrections
  alignas(64) Values value_{};            // the constraints' values at λ
  alignas(64) Values z_{};                // the candidate: those of the variables, within their bounds
  alignas(64) Values z_before_{}, product_before_{};  // the candidate of the last pass, and Q z there
  alignas(64) Values product_{};                      // measured there: Q z,
  alignas(64) Values slope_{};                        //   the gradient of the Lagrangian,
  alignas(64) Values off_{};                          //   and what the rows are off their bounds
};

}  // namespace tendril::qp
