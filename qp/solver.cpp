// SPDX-License-Identifier: Apache-2.0
#include "qp/solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tendril::qp {
namespace {

using Outcome = DualIteration::Outcome;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Relative change of the rows' violations, from one candidate to the next, at which
constexpr double kConflictSuspected = 0.5;     // the least violations are computed,
constexpr double kViolationsConverged = 1e-6;  // these have converged,
constexpr double kRoundingConflict = 1e-2;     // a rest that rounding leaves is taken for a violation
constexpr double kNoConflict = -1;
constexpr double kRowRounding = 1e-12;  // of a row at the last command, relative to its terms

double clip(double value, double lower, double upper) {
  if (!std::isfinite(value)) value = 0;
  if (value < lower && lower < kInfinity) value = lower;
  if (value > upper && upper > -kInfinity) value = upper;
  return value;
}

bool sizes_fit(const Problem& problem, const Vector& g, const Bounds& bounds) {
  const int n = problem.n(), rows = problem.rows();
  return n > 0 && g.size() == n && bounds.lower.size() == n && bounds.upper.size() == n &&
         bounds.row_lower.size() == rows && bounds.row_upper.size() == rows;
}

/// Whether rows that were relaxed are met nevertheless: a conflict that is rounding is none.
/// @param z  n scaled variables
bool rows_met(const Metric& metric, const Bounds& bounds, const Values& z) {
  Values product, size;
  metric.evaluate(z, product, size);
  for (int i = 0; i < metric.rows(); ++i) {
    const int k = metric.first_row() + i;
    const double lower = bounds.row_lower[i] * metric.weight(k),
                 upper = bounds.row_upper[i] * metric.weight(k);
    const double violation = bound_violation(product[k], lower, upper);
    if (!(std::abs(violation) <= kRowAccuracy * (size[k] + std::abs(product[k] - violation)))) return false;
  }
  return true;
}

}  // namespace

const char* name(Status status) noexcept {
  switch (status) {
    case Status::kOptimal:
      return "optimal";
    case Status::kSoftened:
      return "softened";
    case Status::kCapped:
      return "capped";
    case Status::kIllPosed:
      return "ill-posed";
  }
  return "unknown";
}

const Solution& Solver::solve(const Problem& problem, const Vector& g, const Bounds& bounds,
                              const Vector& hold, int iteration_cap) noexcept {
  solution_.iterations = 0;
  if (!sizes_fit(problem, g, bounds)) return ill_posed_result(problem, bounds, hold);
  optimum_.set_gradient(problem.objective_metric(), g);
  if (!problem.two_levels() && iteration_cap > 0 &&
      optimum_.unconstrained_is_optimal(problem.objective_metric(), bounds)) {
    ++solution_.iterations;
    return finish(problem, bounds, hold, optimum_.unconstrained_minimum(), Status::kOptimal);
  }
  return iterate(problem, bounds, hold, iteration_cap);
}

const Solution& Solver::iterate(const Problem& problem, const Bounds& bounds, const Vector& hold, int cap) {
  if (!optimum_.set_bounds(problem.objective_metric(), problem.id(), bounds, problem.energy_weight()))
    return ill_posed_result(problem, bounds, hold);
  bool softened = false;
  Outcome outcome = run(problem, bounds, cap, softened);
  while (outcome == Outcome::kSolved && problem.two_levels() &&
         !optimum_.energy_is_least(problem.objective_metric()))
    outcome = run(problem, bounds, cap, softened);
  if (outcome == Outcome::kCapped) return feasible_fallback(problem, bounds, hold);
  if (softened) softened = !rows_met(problem.objective_metric(), bounds, optimum_.z());
  finish(problem, bounds, hold, optimum_.z(), softened ? Status::kSoftened : Status::kOptimal);
  if (softened)
    solution_.row_violation = worst_violation(problem.objective_metric(), bounds, optimum_.values());
  return solution_;
}

/// Iterates to the optimum; where the rows conflict, with them relaxed by their least violations.
Outcome Solver::run(const Problem& problem, const Bounds& bounds, int cap, bool& softened) {
  const Metric& metric = problem.objective_metric();
  int& iterations = solution_.iterations;
  Outcome outcome = optimum_.run(metric, softened ? kRoundingConflict : kConflictSuspected, iterations, cap);
  if (outcome == Outcome::kConflict && !softened) {
    softened = find_least_violation(problem, bounds, cap, outcome);
    if (outcome != Outcome::kCapped)
      outcome = optimum_.run(metric, softened ? kRoundingConflict : kNoConflict, iterations, cap);
  }
  while (outcome == Outcome::kConflict) {  // each turn iterates at least once, so the cap bounds them
    for (int i = 0; i < problem.rows(); ++i) {
      const int k = metric.first_row() + i;
      optimum_.relax(k, optimum_.violation(k));
    }
    optimum_.drop_corrections();
    outcome = optimum_.run(metric, kRoundingConflict, iterations, cap);
  }
  return outcome;
}

/// Relaxes the rows of the optimum's iteration by their least violations; false where they do not conflict
/// after all.
bool Solver::find_least_violation(const Problem& problem, const Bounds& bounds, int cap, Outcome& outcome) {
  const Metric &least = problem.violation_metric(), &optimum = problem.objective_metric();
  least_violation_.set_gradient(least, Vector::Zero(problem.n()));
  (void)least_violation_.set_bounds(least, problem.id(), bounds, 0);
  outcome = least_violation_.run(least, kViolationsConverged, solution_.iterations, cap);
  if (outcome != Outcome::kConflict) return false;
  for (int k = least.first_row(); k < least.first_row() + least.rows(); ++k)
    optimum_.relax(k, least_violation_.violation(k) * least.unit(k) * optimum.weight(k));
  optimum_.drop_corrections();
  return true;
}

double Solver::multiplier(const Problem& problem, int k) const noexcept {
  const Metric& metric = problem.objective_metric();
  return optimum_.multiplier(metric.number(k)) * metric.weight(metric.number(k));
}

void Solver::reset() noexcept {
  optimum_.reset();
  least_violation_.reset();
}

/// Unscales z.
const Solution& Solver::finish(const Problem& problem, const Bounds& bounds, const Vector& hold,
                               const Values& z, Status status) {
  const int n = problem.n();
  const double* unit = problem.objective_metric().unit();
  Simd size{};
  for (int j = 0; j < n; j += kSimdRows) size += abs(load(&z[j]) * load(unit + j));
  if (!(reduce_sum(size) < kInfinity)) return ill_posed_result(problem, bounds, hold);  // it overflowed
  solution_.x.resize(n);  // not before: `hold` may be the x of the solution before
  for (int j = 0; j < n; j += kSimdRows) {
    const Simd lower = load_partial(bounds.lower.data() + j, n - j),
               upper = load_partial(bounds.upper.data() + j, n - j);
    store(solution_.x.data() + j, min(max(load(&z[j]) * load(unit + j), lower), upper));
  }
  solution_.row_violation = 0;
  solution_.status = status;
  return solution_;
}

/// By how much, at most, the rows' values pass their bounds.
double Solver::worst_violation(const Metric& metric, const Bounds& bounds, const Values& values) {
  double worst = 0;
  for (int i = 0; i < metric.rows(); ++i) {
    const int k = metric.first_row() + i;
    const double row = values[k] * metric.unit(k);
    worst = std::max({worst, bounds.row_lower[i] - row, row - bounds.row_upper[i]});
  }
  return worst;
}

/// The best point on the way from the clipped `hold` to where the iteration stands, with no row worse than at
/// `hold`.
const Solution& Solver::feasible_fallback(const Problem& problem, const Bounds& bounds, const Vector& hold) {
  const int n = problem.n();
  const Metric& metric = problem.objective_metric();
  const Values towards = optimum_.current_primal(metric);
  Values held{}, direction{}, at_hold, along, size, ignored;
  for (int j = 0; j < n; ++j) {
    held[j] = clip(j < hold.size() ? hold[j] : 0, bounds.lower[j], bounds.upper[j]) * metric.weight(j);
    direction[j] = std::isfinite(towards[j]) ? towards[j] - held[j] : 0;
  }
  metric.evaluate(held, at_hold, size);
  metric.evaluate(direction, along, ignored);

  double step = 1;
  bool met = true;
  for (int i = 0; i < metric.rows(); ++i) {
    const int k = metric.first_row() + i;
    const double lower = bounds.row_lower[i] * metric.weight(k),
                 upper = bounds.row_upper[i] * metric.weight(k);
    // A solution that was at a bound a cycle ago may pass it by rounding now.
    const double bound = at_hold[k] < lower ? lower : at_hold[k] > upper ? upper : 0;
    const double rounding = kRowRounding * (size[k] + std::abs(bound));
    met = met && lower - rounding <= at_hold[k] && at_hold[k] <= upper + rounding;
    if (along[k] > 0) step = std::min(step, std::max(upper - at_hold[k], rounding) / along[k]);
    if (along[k] < 0) step = std::min(step, std::min(lower - at_hold[k], -rounding) / along[k]);
  }
  if (met) {  // the objective along the way is ½ curvature step² + slope step
    double slope = 0, curvature = 0;
    for (int j = 0; j < n; ++j) {
      slope += direction[j] * (at_hold[j] + optimum_.gamma()[j]);
      curvature += direction[j] * along[j];
    }
    if (!(slope < 0)) {
      step = 0;
    } else if (-slope < step * curvature) {
      step = -slope / curvature;
    }
  }
  for (int j = 0; j < n; ++j) held[j] += step * direction[j];
  metric.evaluate(held, at_hold, size);
  finish(problem, bounds, hold, held, Status::kCapped);
  solution_.row_violation = worst_violation(metric, bounds, at_hold);
  return solution_;
}

/// The clipped `hold`, for what cannot be solved.
const Solution& Solver::ill_posed_result(const Problem& problem, const Bounds& bounds, const Vector& hold) {
  reset();
  const auto entry = [](const Vector& values, int j, double otherwise) {
    return j < values.size() ? values[j] : otherwise;
  };
  const int n = problem.n() > 0 ? problem.n() : static_cast<int>(hold.size());
  Vector clipped(n);
  for (int j = 0; j < n; ++j)
    clipped[j] =
        clip(entry(hold, j, 0), entry(bounds.lower, j, -kInfinity), entry(bounds.upper, j, kInfinity));
  solution_.x = clipped;
  solution_.row_violation = 0;
  solution_.status = Status::kIllPosed;
  return solution_;
}

}  // namespace tendril::qp
