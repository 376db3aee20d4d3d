#include "qp/dual_iteration.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tendril::qp {
namespace {

using Side = WorkingSet::Side;

constexpr double kFeasibility = 1e-11;  // of a constraint in the loop, relative to the values at the start
constexpr double kAccuracy = 1e-9;      // of a row of a candidate, relative to its terms
constexpr double kCoarse = 1e-7;        // the same, where rounding forbids that
constexpr double kVanishing = 1e-11;    // of a row, relative to what it might be
// What a candidate may be off, by Metric::error(), to be taken unmeasured: relative to the largest scaled
// variable; where no constraint is active, to the largest of γ.
constexpr double kTrusted = 1e-8;
constexpr double kTrustedFree = 1e-10;
constexpr double kStationarity = 1e-8;  // of the Lagrangian, relative to the largest of γ and z
// Of a candidate for the least energy: the last change, in the norm of the working Hessian and relative to
// itself.
constexpr double kLeastEnergy = 1e-7;
constexpr double kEnergyAccuracy = 1e-6;  // of the efforts of the least energy, in its norm
constexpr int kPasses = 12;               // towards the least energy; two to six are usual
constexpr int kStalls = 8;                // so often stuck, candidates wander about within rounding
constexpr int kUpdatesLimit = 256;        // of the factor before it is made anew

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double beyond(double value, double lower, double upper) {
  return value < lower ? value - lower : value > upper ? value - upper : 0;
}

/// result = values − Σ_i coefficient_i (column of G for constraint number(i)), i = 0..count-1; values may be
/// nullptr, for zeros.
template <typename Number>
inline void subtract_columns(const Metric& metric, int count, const Number& number,
                             const double* coefficients, const double* values, double* result) {
  const int stride = metric.stride();
  int k = 0;
  const auto sweep = [&]<int kStrips>() {
    Strip sums[kStrips];
    for (int s = 0; s < kStrips; ++s) sums[s] = values ? load(values + k + s * kStrip) : Strip{};
#pragma GCC unroll 2
    for (int i = 0; i < count; ++i) {
      const double* column = metric.gram(number(i)) + k;
      const Strip coefficient = broadcast(coefficients[i]);
#pragma GCC unroll 4
      for (int s = 0; s < kStrips; ++s) sums[s] -= load(column + s * kStrip) * coefficient;
    }
    for (int s = 0; s < kStrips; ++s) store(result + k + s * kStrip, sums[s]);
    k += kStrips * kStrip;
  };
  while (k + 4 * kStrip <= stride) sweep.template operator()<4>();
  if (k < stride) sweep.template operator()<2>();  // as long as variables are, so are rows
}

}  // namespace

DualIteration::Outcome DualIteration::run(const Metric& metric, double settled, int& iterations,
                                          int cap) noexcept {
  while (iterations < cap) {
    ++iterations;

    // Dual feasibility: each multiplier keeps its sign.
    if (const int blocking = move_multipliers(); blocking >= 0) {
      leave(blocking);
      continue;
    }
    // Primal feasibility: each value keeps its bounds.
    update_values(metric);
    if (const int k = most_violated(); k >= 0) {
      enter(metric, k);
      continue;
    }
    // Complementarity holds by construction, stationarity up to rounding, softness and the proximal term.
    switch (judge(metric, settled)) {
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

void DualIteration::set_gradient(const Metric& metric, const Vector& g) noexcept {
  if (metric.n() != n_) reset();
  n_ = metric.n();
  first_row_ = metric.first_row();
  passes_ = 0;
  Strip most{}, terms{};
  for (int j = 0; j < first_row_; j += kStrip) {
    const Strip gamma = load_some(g.data() + j, n_ - j) * load(metric.unit() + j);
    store(&gamma_[j], gamma);
    most = max(most, abs(gamma));
    terms += abs(gamma);
  }
  largest_ = largest(most);
  terms_ = sum(terms);
  subtract_columns(
      metric, n_, [](int j) { return j; }, gamma_.data(), nullptr, start_.data());
}

bool DualIteration::free(const Metric& metric, const Bounds& bounds) noexcept {
  if (working_set_.size() > 0 || !(metric.error() * terms_ <= kTrustedFree * largest_)) return false;
  Mask met = Strip{} == Strip{};
  const auto check = [&](const Vector& lower, const Vector& upper, int j, int k) {
    const Strip value = load(&start_[k]) * load(metric.unit() + k);
    met &= (load_some(lower.data() + j, n_ - j) <= value) & (value <= load_some(upper.data() + j, n_ - j));
  };
  for (int j = 0; j < first_row_; j += kStrip) {
    check(bounds.lower, bounds.upper, j, j);
    check(bounds.row_lower, bounds.row_upper, j, first_row_ + j);
    store(&z_[j], load(&start_[j]));
  }
  return all(met);
}

bool DualIteration::set_bounds(const Metric& metric, std::uint64_t id, const Bounds& bounds,
                               double energy_weight) noexcept {
  energy_weight_ = energy_weight;
  Mask valid = Strip{} == Strip{};
  Strip size{};
  const auto take = [&](const Vector& lower, const Vector& upper, int j, int k) {
    const Strip weight = load(metric.weight() + k), value = load(&start_[k]);
    const Strip l = load_some(lower.data() + j, n_ - j) * weight;
    const Strip u = load_some(upper.data() + j, n_ - j) * weight;
    valid &= (l <= u) & (l < broadcast(kInfinity)) & (u > broadcast(-kInfinity));
    size = max(size, abs(min(max(value, l), u)));
    store(&lower_[k], l);
    store(&upper_[k], u);
  };
  for (int j = 0; j < first_row_; j += kStrip) {
    take(bounds.lower, bounds.upper, j, j);
    take(bounds.row_lower, bounds.row_upper, j, first_row_ + j);
    store(&shift_[first_row_ + j], Strip{});
    store(&off_[first_row_ + j], Strip{});
  }
  if (!all(valid) || !(terms_ < kInfinity)) return false;
  size_ = largest(size);
  worst_ = slope_length_ = kInfinity;
  stalls_ = 0;
  resume(metric, id);
  return true;
}

/// Fits the working set of the problem before to this one.
void DualIteration::resume(const Metric& metric, std::uint64_t id) {
  if (id != id_ || working_set_.updates() > kUpdatesLimit) working_set_.refactor(metric);
  id_ = id;
  working_set_.forget_b();
  for (int i = working_set_.size() - 1; i >= 0; --i) {
    const int k = working_set_.constraint(i);
    if (!std::isfinite(working_set_.multiplier(i))) return working_set_.clear();
    Side side = working_set_.side(i);
    if (side == Side::kBoth) side = working_set_.multiplier(i) < 0 ? Side::kLower : Side::kUpper;
    const double bound = side == Side::kLower ? lower_[k] : upper_[k];
    working_set_.set_side(i, lower_[k] == upper_[k] ? Side::kBoth : side);
    if (!std::isfinite(bound)) working_set_.drop(i);
  }
}

void DualIteration::enter(const Metric& metric, int k) {
  const bool equality = lower_[k] == upper_[k];
  working_set_.add(metric, k, equality ? Side::kBoth : value_[k] < lower_[k] ? Side::kLower : Side::kUpper);
  slope_length_ = kInfinity;
}

void DualIteration::leave(int i) {
  working_set_.drop(i);
  slope_length_ = kInfinity;
}

/// That at which entry i of the working set is held.
double DualIteration::bound(int i) const {
  const int k = working_set_.constraint(i);
  return working_set_.side(i) == Side::kLower ? lower_[k] : upper_[k];
}

/// One step on the face of the working set; the entry that blocks it, or -1.
int DualIteration::move_multipliers() {
  return working_set_.move_towards([this](int i) { return start_[working_set_.constraint(i)] - bound(i); });
}

/// The constraints' values at λ: those of the working set are at their bounds, softness granted.
void DualIteration::update_values(const Metric& metric) {
  const int* constraints = working_set_.constraints();
  subtract_columns(
      metric, working_set_.size(), [=](int i) { return constraints[i]; }, working_set_.multipliers(),
      start_.data(), value_.data());
  all_terms_ = terms_;
  for (int i = 0; i < working_set_.size(); ++i) {
    value_[constraints[i]] = bound(i);
    all_terms_ += std::abs(working_set_.multiplier(i));
  }
}

/// The constraint farthest outside its bounds, the lowest of equals; -1 where all are within.
int DualIteration::most_violated() const {
  const double tolerance = kFeasibility * size_ + kRounding * all_terms_;
  Strip most = broadcast(tolerance);
  const auto violation = [this](int k) {
    return max(load(&lower_[k]) - load(&value_[k]), load(&value_[k]) - load(&upper_[k]));
  };
  for (int k = 0; k < 2 * first_row_; k += kStrip) most = max(most, violation(k));
  const double worst = largest(most);
  if (worst <= tolerance) return -1;
  for (int k = 0; k < 2 * first_row_; k += kStrip) {
    const Strip here = violation(k);
    for (int i = 0; i < kStrip; ++i)
      if (here[i] == worst) return k + i;
  }
  return -1;
}

/// Takes the candidate at λ. Where what it may be off by is known to be little, and to be worth little, that
/// is all; else it is measured.
DualIteration::Verdict DualIteration::judge(const Metric& metric, double settled) {
  Strip extent{}, worth{};
  for (int j = 0; j < first_row_; j += kStrip) {
    const Strip z = min(max(load(&value_[j]), load(&lower_[j])), load(&upper_[j]));
    store(&z_[j], z);
    extent = max(extent, abs(z));
    worth += abs(z * load(&gamma_[j]));
  }
  const double off = metric.error() * all_terms_;
  if (energy_weight_ == 0 && off <= kTrusted * largest(extent) &&
      off * (all_terms_ - terms_) <= kAccuracy * sum(worth))
    return Verdict::kSolved;
  return measure(metric, settled);
}

/// How far the candidate is from solving the problem as it was given.
DualIteration::Verdict DualIteration::measure(const Metric& metric, double settled) {
  Values size;
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
    if (k < first_row_) {
      slope_[k] += lambda;
      size[k] += std::abs(lambda);
      continue;
    }
    for (int j = 0; j < n_; ++j) {
      slope_[j] += metric.q(j)[k] * lambda;
      size[j] += std::abs(metric.q(j)[k] * lambda);
    }
  }
  const Rows rows = judge_rows(metric, settled, size, worth);
  const Verdict verdict = rows == Rows::kConflict                          ? Verdict::kConflict
                          : rows == Rows::kMet && stationary(metric, size) ? Verdict::kSolved
                                                                           : Verdict::kInexact;
  if (verdict != Verdict::kInexact) std::copy_n(&product_[first_row_], first_row_, &value_[first_row_]);
  return verdict;
}

/// Whether the rows are met: those of the working set at their bounds, the others within.
/// @param size   magnitudes of the terms of Q z
/// @param worth  magnitude of the objective, which what a row is off changes by λ_k times as much
DualIteration::Rows DualIteration::judge_rows(const Metric& metric, double settled, const Values& size,
                                              double worth) {
  Values off;
  bool fine = true, coarse = true;
  const double rounding = kRounding * all_terms_;
  // Of a row whose bound is zero, and which vanishes next to its reach, all is what rounding leaves.
  const auto vanishes = [&](int k) {
    return product_[k] == off[k] && size[k] <= kVanishing * reach(metric, k);
  };
  for (int k = first_row_; k < first_row_ + n_; ++k) off[k] = beyond(product_[k], lower_[k], upper_[k]);
  for (int i = 0; i < working_set_.size(); ++i) {
    const int k = working_set_.constraint(i);
    if (k < first_row_) continue;
    off[k] = product_[k] - value_[k];
    const double lambda = std::abs(working_set_.multiplier(i)), price = std::abs(off[k]) * lambda;
    fine = fine && (vanishes(k) || price <= kAccuracy * worth);
    coarse = coarse && (vanishes(k) || price <= kAccuracy * worth + rounding * lambda);
  }
  double worst = 0, change = 0;
  for (int k = first_row_; k < first_row_ + n_; ++k) {
    const double terms = size[k] + std::abs(product_[k] - off[k]), distance = std::abs(off[k]);
    if (!vanishes(k)) {
      fine = fine && distance <= kAccuracy * terms;
      coarse = coarse && distance <= std::clamp(rounding, kAccuracy * terms, kCoarse * terms);
    }
    change = std::max(change, std::abs(off[k] - off_[k]));
    worst = std::max(worst, distance);
    off_[k] = off[k];
  }
  const bool stalled = worst > worst_ / 2;
  stalls_ += stalled;
  worst_ = worst;
  if (fine || (coarse && (stalled || stalls_ >= kStalls))) return Rows::kMet;
  return change <= settled * worst ? Rows::kConflict : Rows::kOff;
}

/// What the bounds of the variables, or, where all of these are zero or infinite, γ let row k come to.
double DualIteration::reach(const Metric& metric, int k) const {
  double by_bounds = 0, by_gamma = 0;
  bool bounded = false;
  for (int j = 0; j < n_; ++j) {
    double room = 0;
    for (const double bound : {lower_[j], upper_[j]})
      if (std::isfinite(bound)) room = std::max(room, std::abs(bound));
    bounded = bounded || room > 0;
    by_bounds += std::abs(metric.q(j)[k] * room);
    by_gamma += std::abs(metric.q(j)[k] * gamma_[j]);
  }
  return bounded ? by_bounds : by_gamma;
}

/// Whether the gradient of the Lagrangian vanishes: next to the candidate, or, where rounding forbids that,
/// next to γ, which is far larger where H is nearly singular. Its square in the metric bounds twice the
/// excess of the objective.
bool DualIteration::stationary(const Metric& metric, const Values& size) {
  double square = 0, terms = 0, extent = 0, energy = 0;
  for (int j = 0; j < n_; ++j) {
    const double* gram = metric.gram(j);
    double sum = 0;
    for (int i = 0; i < n_; ++i) sum += gram[i] * slope_[i];
    square += sum * slope_[j];
    terms += size[j];
    extent = std::max(extent, std::abs(z_[j]));
    const int k = first_row_ + j;
    energy += energy_weight_ * z_[j] * metric.unit(j) * product_[k] * metric.unit(k);
  }
  const double length = std::sqrt(square), before = slope_length_;
  slope_length_ = length;
  const double wanted = energy_weight_ > 0 ? kEnergyAccuracy * std::sqrt(energy) : kStationarity * extent;
  if (length <= wanted) return true;
  return length > before / 2 && length <= kStationarity * std::max(extent, largest_) + kRounding * terms;
}

/// Moves the values at λ = 0 by what was measured: γ by the remaining gradient, the rows by what they are
/// off.
void DualIteration::correct(const Metric& metric) {
  for (int k = first_row_; k < first_row_ + n_; ++k) {
    start_[k] += product_[k] - value_[k];
    shift_[k] += product_[k] - value_[k];
  }
  move_start(metric, slope_);
}

/// Moves the values at λ = 0 to where they are for a γ that is larger by this.
void DualIteration::move_start(const Metric& metric, const Values& gamma) {
  subtract_columns(
      metric, n_, [](int j) { return j; }, gamma.data(), start_.data(), start_.data());
  working_set_.forget_b();
}

bool DualIteration::least_energy(const Metric& metric) noexcept {
  // The method of multipliers for "least energy, with the least objective": what γ is shifted by are the
  // multipliers of the latter, and each pass makes the error less by the ratio of energy to objective.
  // [Chiche & Gilbert 2016]
  const Values before = z_before_, product_before = product_before_;
  z_before_ = z_;
  product_before_ = product_;  // of two levels, each candidate has been measured
  if (passes_ == 0) gradient_ = gamma_;
  if (passes_ > 0) {
    double change = 0, extent = 0;
    for (int j = 0; j < n_; ++j) {
      change += (z_[j] - before[j]) * (product_before_[j] - product_before[j]);
      extent += z_[j] * product_before_[j];
    }
    if (change <= kLeastEnergy * kLeastEnergy * extent || passes_ == kPasses) return true;
  }
  ++passes_;
  slope_length_ = kInfinity;
  largest_ = terms_ = 0;
  for (int j = 0; j < n_; ++j) {
    const int k = first_row_ + j;
    const double energy = energy_weight_ * product_before_[k] * metric.unit(k) * metric.unit(j);
    slope_[j] = product_before_[j] - energy + gradient_[j];
    gamma_[j] += slope_[j];
    largest_ = std::max(largest_, std::abs(gamma_[j]));
    terms_ += std::abs(gamma_[j]);
  }
  move_start(metric, slope_);
  return false;
}

void DualIteration::relax(int k, double violation) noexcept {
  const bool equality = lower_[k] == upper_[k];
  if (violation < 0 || equality) lower_[k] += violation;
  if (violation > 0 || equality) upper_[k] += violation;
}

void DualIteration::settle() noexcept {
  worst_ = slope_length_ = kInfinity;
  stalls_ = 0;
  for (int k = first_row_; k < first_row_ + n_; ++k) {
    start_[k] -= shift_[k];
    shift_[k] = off_[k] = 0;
  }
  working_set_.forget_b();
}

double DualIteration::violation(int k) const { return beyond(value_[k], lower_[k], upper_[k]); }

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
