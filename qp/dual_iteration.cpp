// SPDX-License-Identifier: Apache-2.0
#include "qp/dual_iteration.h"

#include <cmath>

#include "qp/gram_product.h"

namespace tendril::qp {
namespace {

using Side = WorkingSet::Side;

constexpr double kFeasibility = 1e-11;  // of a constraint, relative to the values at the start
// Largest error of the minimum without active constraints, by Metric::error(), relative to the largest of γ.
constexpr double kUnconstrainedError = 1e-10;
constexpr int kMaxUpdates = 256;  // of the factor before it is computed again

}  // namespace

DualIteration::Outcome DualIteration::run(const Metric& metric, double settled, int& iterations,
                                          int cap) noexcept {
  while (iterations < cap) {
    ++iterations;

    // Dual feasibility: each multiplier keeps its sign.
    if (const int blocking = step_multipliers(); blocking >= 0) {
      drop(blocking);
      continue;
    }
    // Primal feasibility: each value keeps its bounds.
    update_values(metric);
    if (const int k = most_violated(); k >= 0) {
      add(metric, k);
      continue;
    }
    // Complementarity holds by construction, stationarity up to rounding, softness and the proximal term.
    switch (refinement_.accept(metric, problem_, working_set_, candidate_, settled)) {
      case Refinement::Result::kAccepted:
        return Outcome::kSolved;
      case Refinement::Result::kConflict:
        return Outcome::kConflict;
      case Refinement::Result::kInexact:
        refinement_.correct(metric, problem_, candidate_);
        working_set_.invalidate_b();
    }
  }
  return Outcome::kCapped;
}

void DualIteration::set_gradient(const Metric& metric, const Vector& g) noexcept {
  if (metric.n() != problem_.n() || metric.rows() != problem_.rows()) reset();
  problem_.set_gradient(metric, g);
}

bool DualIteration::unconstrained_is_optimal(const Metric& metric, const Bounds& bounds) const noexcept {
  return working_set_.size() == 0 &&
         metric.error() * problem_.gamma_sum() <= kUnconstrainedError * problem_.gamma_max() &&
         problem_.minimum_meets(metric, bounds);
}

bool DualIteration::set_bounds(const Metric& metric, uint64_t id, const Bounds& bounds,
                               double energy_weight) noexcept {
  energy_passes_.begin(energy_weight);
  if (!problem_.set_bounds(metric, bounds)) return false;
  refinement_.begin(problem_, energy_weight);
  warm_start(metric, id);
  return true;
}

/// Fits the working set of the problem before to this one.
void DualIteration::warm_start(const Metric& metric, uint64_t id) {
  if (id != id_ || working_set_.updates() > kMaxUpdates) working_set_.refactor(metric);
  id_ = id;
  working_set_.invalidate_b();
  for (int i = working_set_.size() - 1; i >= 0; --i) {
    const int k = working_set_.constraint(i);
    const double lower = problem_.lower()[k], upper = problem_.upper()[k];
    if (!std::isfinite(working_set_.multiplier(i))) return working_set_.clear();
    Side side = working_set_.side(i);
    if (side == Side::kBoth) side = working_set_.multiplier(i) < 0 ? Side::kLower : Side::kUpper;
    const double bound = side == Side::kLower ? lower : upper;
    working_set_.set_side(i, lower == upper ? Side::kBoth : side);
    if (!std::isfinite(bound)) working_set_.drop(i);
  }
}

void DualIteration::add(const Metric& metric, int k) {
  const double lower = problem_.lower()[k];
  const bool equality = lower == problem_.upper()[k];
  working_set_.add(metric, k,
                   equality                       ? Side::kBoth
                   : candidate_.values[k] < lower ? Side::kLower
                                                  : Side::kUpper);
  refinement_.expect_new_gradient();
}

void DualIteration::drop(int i) {
  working_set_.drop(i);
  refinement_.expect_new_gradient();
}

/// The bound at which entry i of the working set is held.
double DualIteration::bound(int i) const {
  const int k = working_set_.constraint(i);
  return working_set_.side(i) == Side::kLower ? problem_.lower()[k] : problem_.upper()[k];
}

/// One step on the face of the working set; the entry that blocks it, or -1.
int DualIteration::step_multipliers() {
  return working_set_.step_towards(
      [this](int i) { return problem_.start()[working_set_.constraint(i)] - bound(i); });
}

/// The constraints' values at λ: those of the working set are at their bounds, except for softness.
void DualIteration::update_values(const Metric& metric) {
  const int* constraints = working_set_.constraints();
  subtract_columns(
      metric, working_set_.size(), [=](int i) { return constraints[i]; }, working_set_.multipliers(),
      problem_.start().data(), candidate_.values.data());
  double term_sum = problem_.gamma_sum();
  for (int i = 0; i < working_set_.size(); ++i) {
    candidate_.values[constraints[i]] = bound(i);
    term_sum += std::abs(working_set_.multiplier(i));
  }
  candidate_.term_sum = term_sum;
}

/// The constraint farthest outside its bounds, the lowest of equals; -1 where all are within.
int DualIteration::most_violated() const {
  const double tolerance = kFeasibility * problem_.value_max() + kRounding * candidate_.term_sum;
  Simd most = broadcast(tolerance);
  const auto violations = [this](int k) {
    const Simd value = load(&candidate_.values[k]);
    return max(load(&problem_.lower()[k]) - value, value - load(&problem_.upper()[k]));
  };
  for (int k = 0; k < problem_.stride(); k += kSimdRows) most = max(most, violations(k));
  const double largest = reduce_max(most);
  if (largest <= tolerance) return -1;
  for (int k = 0; k < problem_.stride(); k += kSimdRows) {
    const Simd here = violations(k);
    for (int i = 0; i < kSimdRows; ++i)
      if (here[i] == largest) return k + i;
  }
  return -1;
}

bool DualIteration::energy_is_least(const Metric& metric) noexcept {
  if (energy_passes_.converged(metric, refinement_, candidate_.term_sum, problem_)) return true;
  refinement_.expect_new_gradient();
  working_set_.invalidate_b();
  return false;
}

void DualIteration::drop_corrections() noexcept {
  refinement_.drop_corrections(problem_);
  working_set_.invalidate_b();
}

double DualIteration::violation(int k) const {
  return bound_violation(candidate_.values[k], problem_.lower()[k], problem_.upper()[k]);
}

Values DualIteration::current_primal(const Metric& metric) noexcept {
  update_values(metric);
  Values result{};
  for (int j = 0; j < problem_.n(); ++j) result[j] = candidate_.values[j] - violation(j);
  return result;
}

double DualIteration::multiplier(int k) const {
  for (int i = 0; i < working_set_.size(); ++i)
    if (working_set_.constraint(i) == k) return working_set_.multiplier(i);
  return 0;
}

void DualIteration::reset() {
  working_set_.clear();
  id_ = 0;
}

}  // namespace tendril::qp
