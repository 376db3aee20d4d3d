#include "qp/dual_iteration.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tendril::qp {
namespace {

using Side = WorkingSet::Side;

constexpr double kFeasibility = 1e-11;  // of a constraint in the loop, relative to the values at the start
constexpr double kRounding = 4e-16;     // of a sum, relative to the sum of its terms' magnitudes
constexpr double kAccuracy = 1e-9;      // of a row of a candidate, relative to its terms
constexpr double kCoarse = 1e-7;        // the same, where rounding forbids that
constexpr double kStationarity = 1e-8;  // of the Lagrangian, relative to the largest of γ and z
constexpr int kUpdatesLimit = 256;      // of the factor before it is made anew

double beyond(double value, double lower, double upper) {
  return value < lower ? value - lower : value > upper ? value - upper : 0;
}

}  // namespace

DualIteration::Outcome DualIteration::run(const Metric& metric, double settled, int& iterations,
                                          int cap) noexcept {
  while (iterations < cap) {
    ++iterations;

    // Dual feasibility: each multiplier keeps its sign.
    if (const int blocking = move_multipliers(); blocking >= 0) {
      working_set_.drop(blocking);
      continue;
    }
    // Primal feasibility: each value keeps its bounds.
    update_values(metric);
    if (const int k = most_violated(); k >= 0) {
      const bool equality = lower_[k] == upper_[k];
      working_set_.add(metric, k,
                       equality                ? Side::kBoth
                       : value_[k] < lower_[k] ? Side::kLower
                                               : Side::kUpper);
      continue;
    }
    // Complementarity holds by construction, stationarity up to rounding, softness and the proximal term.
    switch (measure(metric, settled)) {
      case Verdict::kSolved:
        return Outcome::kSolved;
      case Verdict::kConflict:
        return Outcome::kConflict;
      case Verdict::kInexact:
        correct(metric);
    }
  }
  return Outcome::kCapped;
}

void DualIteration::load(const Metric& metric, std::uint64_t id, const Vector& g,
                         const Bounds& bounds) noexcept {
  if (metric.n() != n_) reset();
  const int n = n_ = metric.n(), stride = metric.stride();
  std::fill_n(start_.begin(), stride, 0.0);
  std::fill_n(shift_.begin(), stride, 0.0);
  std::fill_n(off_.begin(), stride, 0.0);
  worst_ = std::numeric_limits<double>::infinity();
  largest_ = terms_ = size_ = 0;
  for (int j = 0; j < n; ++j) {
    gamma_[j] = g[j] * metric.unit(j);
    largest_ = std::max(largest_, std::abs(gamma_[j]));
    terms_ += std::abs(gamma_[j]);
    const double* gram = metric.gram(j);
    for (int k = 0; k < stride; ++k) start_[k] -= gram[k] * gamma_[j];
  }
  for (int k = 0; k < n; ++k) {
    lower_[k] = bounds.lower[k] * metric.weight(k);
    upper_[k] = bounds.upper[k] * metric.weight(k);
    lower_[n + k] = bounds.row_lower[k] * metric.weight(n + k);
    upper_[n + k] = bounds.row_upper[k] * metric.weight(n + k);
  }
  for (int k = 0; k < 2 * n; ++k)
    size_ = std::max(size_, std::abs(start_[k] - beyond(start_[k], lower_[k], upper_[k])));
  resume(metric, id);
}

/// Fits the working set of the problem before to this one.
void DualIteration::resume(const Metric& metric, std::uint64_t id) {
  if (id != id_ || working_set_.updates() > kUpdatesLimit) working_set_.refactor(metric);
  id_ = id;
  for (int i = working_set_.size() - 1; i >= 0; --i) {
    const int k = working_set_.constraint(i);
    Side side = working_set_.side(i);
    if (side == Side::kBoth) side = working_set_.multiplier(i) < 0 ? Side::kLower : Side::kUpper;
    const double bound = side == Side::kLower ? lower_[k] : upper_[k];
    working_set_.set_side(i, lower_[k] == upper_[k] ? Side::kBoth : side);
    if (!std::isfinite(bound) || !std::isfinite(working_set_.multiplier(i))) working_set_.drop(i);
  }
}

/// One step on the face of the working set; the entry that blocks it, or -1.
int DualIteration::move_multipliers() {
  Values excess;
  for (int i = 0; i < working_set_.size(); ++i) {
    const int k = working_set_.constraint(i);
    excess[i] = start_[k] - (working_set_.side(i) == Side::kLower ? lower_[k] : upper_[k]);
  }
  return working_set_.move_towards(excess.data());
}

/// The constraints' values at λ: those of the working set are at their bounds, softness granted.
void DualIteration::update_values(const Metric& metric) {
  const int stride = metric.stride();
  std::copy_n(start_.begin(), stride, value_.begin());
  double terms = terms_;
  for (int i = 0; i < working_set_.size(); ++i) {
    const double lambda = working_set_.multiplier(i);
    const double* gram = metric.gram(working_set_.constraint(i));
    for (int k = 0; k < stride; ++k) value_[k] -= gram[k] * lambda;
    terms += std::abs(lambda);
  }
  for (int i = 0; i < working_set_.size(); ++i) {
    const int k = working_set_.constraint(i);
    value_[k] = working_set_.side(i) == Side::kLower ? lower_[k] : upper_[k];
  }
  rounding_ = kRounding * terms;
}

/// The constraint farthest outside its bounds, the lowest of equals; -1 where all are within.
int DualIteration::most_violated() const {
  int worst = -1;
  double most = kFeasibility * size_ + rounding_;
  for (int k = 0; k < 2 * n_; ++k) {
    const double violation = std::max(lower_[k] - value_[k], value_[k] - upper_[k]);
    if (violation > most) most = violation, worst = k;
  }
  return worst;
}

/// Takes the candidate at λ and measures how far it is from solving the problem as it was given.
DualIteration::Verdict DualIteration::measure(const Metric& metric, double settled) {
  Values size;
  for (int j = 0; j < n_; ++j) z_[j] = value_[j] - beyond(value_[j], lower_[j], upper_[j]);
  metric.evaluate(z_, product_, size);
  double worth = 0;
  for (int j = 0; j < n_; ++j) {
    slope_[j] = product_[j] + gamma_[j];
    size[j] += std::abs(gamma_[j]);
    worth += std::abs(z_[j]) * size[j];
  }
  for (int i = 0; i < working_set_.size(); ++i) {
    const int k = working_set_.constraint(i);
    const double lambda = working_set_.multiplier(i);
    if (k < n_) {
      slope_[k] += lambda;
      size[k] += std::abs(lambda);
      continue;
    }
    for (int j = 0; j < n_; ++j) {
      slope_[j] += metric.q(j)[k] * lambda;
      size[j] += std::abs(metric.q(j)[k] * lambda);
    }
  }
  const Rows rows = judge_rows(settled, size, worth);
  if (rows == Rows::kConflict) return Verdict::kConflict;
  return rows == Rows::kMet && stationary(metric, size) ? Verdict::kSolved : Verdict::kInexact;
}

/// Whether the rows are met: those of the working set at their bounds, the others within.
/// @param size   magnitudes of the terms of Q z
/// @param worth  magnitude of the objective, which what a row is off changes by λ_k times as much
DualIteration::Rows DualIteration::judge_rows(double settled, const Values& size, double worth) {
  Values off;
  bool fine = true, coarse = true;
  for (int k = n_; k < 2 * n_; ++k) off[k] = violation(k);
  for (int i = 0; i < working_set_.size(); ++i) {
    const int k = working_set_.constraint(i);
    if (k < n_) continue;
    off[k] = product_[k] - value_[k];
    const double lambda = std::abs(working_set_.multiplier(i)), price = std::abs(off[k]) * lambda;
    fine = fine && price <= kAccuracy * worth;
    coarse = coarse && price <= kAccuracy * worth + rounding_ * lambda;
  }
  double worst = 0, change = 0;
  for (int k = n_; k < 2 * n_; ++k) {
    const double terms = size[k] + std::abs(product_[k] - off[k]);
    fine = fine && std::abs(off[k]) <= kAccuracy * terms;
    coarse = coarse && std::abs(off[k]) <= std::clamp(rounding_, kAccuracy * terms, kCoarse * terms);
    change = std::max(change, std::abs(off[k] - off_[k]));
    worst = std::max(worst, std::abs(off[k]));
    off_[k] = off[k];
  }
  const bool stalled = worst > worst_ / 2;
  worst_ = worst;
  if (fine || (coarse && stalled)) return Rows::kMet;
  return change <= settled * worst ? Rows::kConflict : Rows::kOff;
}

/// Whether the gradient of the Lagrangian vanishes. Its square in the metric bounds twice the excess of the
/// objective.
bool DualIteration::stationary(const Metric& metric, const Values& size) const {
  double square = 0, terms = 0, extent = largest_;
  for (int j = 0; j < n_; ++j) {
    const double* gram = metric.gram(j);
    double sum = 0;
    for (int i = 0; i < n_; ++i) sum += gram[i] * slope_[i];
    square += sum * slope_[j];
    terms += size[j];
    extent = std::max(extent, std::abs(z_[j]));
  }
  return std::sqrt(square) <= kStationarity * extent + kRounding * terms;
}

/// Moves the values at λ = 0 by what was measured: γ by the remaining gradient, the rows by what they are
/// off.
void DualIteration::correct(const Metric& metric) {
  const int stride = metric.stride();
  for (int k = n_; k < 2 * n_; ++k) {
    start_[k] += product_[k] - value_[k];
    shift_[k] += product_[k] - value_[k];
  }
  for (int j = 0; j < n_; ++j) {
    const double* gram = metric.gram(j);
    for (int k = 0; k < stride; ++k) start_[k] -= gram[k] * slope_[j];
  }
}

void DualIteration::relax(int k, double violation) noexcept {
  const bool equality = lower_[k] == upper_[k];
  if (violation < 0 || equality) lower_[k] += violation;
  if (violation > 0 || equality) upper_[k] += violation;
}

void DualIteration::settle() noexcept {
  worst_ = std::numeric_limits<double>::infinity();
  for (int k = n_; k < 2 * n_; ++k) {
    start_[k] -= shift_[k];
    shift_[k] = off_[k] = 0;
  }
}

double DualIteration::violation(int k) const { return beyond(product_[k], lower_[k], upper_[k]); }

Values DualIteration::standing(const Metric& metric) noexcept {
  update_values(metric);
  Values result{};
  for (int j = 0; j < n_; ++j) result[j] = value_[j] - beyond(value_[j], lower_[j], upper_[j]);
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
