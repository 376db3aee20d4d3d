// SPDX-License-Identifier: Apache-2.0
#include "qp/refinement.h"

#include <algorithm>
#include <cmath>

namespace tendril::qp {
namespace {

constexpr double kLooseAccuracy = 1e-7;  // of a row, where rounding forbids kRowAccuracy
constexpr double kNegligible = 1e-11;    // of a row, relative to row_scale()
// Largest error of a candidate, by Metric::error(), that is accepted without evaluating residuals, relative
// to the largest scaled variable.
constexpr double kAcceptedError = 1e-8;
constexpr double kStationarity = 1e-8;    // of the Lagrangian, relative to the largest of γ and z
constexpr double kEnergyAccuracy = 1e-6;  // of the efforts of the least energy, in its norm
constexpr int kMaxStalls = 8;             // after so many, candidates change within rounding only

/// Magnitude that the bounds of the variables give row k; if all of these are zero or infinite, what γ gives
/// it.
double row_scale(const Metric& metric, const ScaledProblem& problem, int k) {
  double by_bounds = 0, by_gamma = 0;
  bool bounded = false;
  for (int j = 0; j < problem.n(); ++j) {
    double room = 0;
    for (const double bound : {problem.lower()[j], problem.upper()[j]})
      if (std::isfinite(bound)) room = std::max(room, std::abs(bound));
    bounded = bounded || room > 0;
    by_bounds += std::abs(metric.q(j)[k] * room);
    by_gamma += std::abs(metric.q(j)[k] * problem.gamma()[j]);
  }
  return bounded ? by_bounds : by_gamma;
}

}  // namespace

void Refinement::begin(const ScaledProblem& problem, double energy_weight) noexcept {
  energy_weight_ = energy_weight;
  for (int k = problem.first_row(); k < problem.stride(); k += kSimdRows) {
    store(&row_correction_[k], Simd{});
    store(&row_residual_[k], Simd{});
  }
  max_row_residual_ = gradient_norm_ = std::numeric_limits<double>::infinity();
  stalls_ = 0;
}

Refinement::Result Refinement::accept(const Metric& metric, const ScaledProblem& problem,
                                      const WorkingSet& working_set, Candidate& candidate,
                                      double settled) noexcept {
  Simd z_max{}, objective{};
  for (int j = 0; j < problem.first_row(); j += kSimdRows) {
    const Simd z = min(max(load(&candidate.values[j]), load(&problem.lower()[j])), load(&problem.upper()[j]));
    store(&z_[j], z);
    z_max = max(z_max, abs(z));
    objective += abs(z * load(&problem.gamma()[j]));
  }
  const double error = metric.error() * candidate.term_sum;
  if (energy_weight_ == 0 && error <= kAcceptedError * reduce_max(z_max) &&
      error * (candidate.term_sum - problem.gamma_sum()) <= kRowAccuracy * reduce_sum(objective))
    return Result::kAccepted;
  return accept_by_residuals(metric, problem, working_set, candidate, settled);
}

Refinement::Result Refinement::accept_by_residuals(const Metric& metric, const ScaledProblem& problem,
                                                   const WorkingSet& working_set, Candidate& candidate,
                                                   double settled) {
  evaluate_residuals(metric, problem, working_set);
  const RowResult rows = check_rows(metric, problem, working_set, candidate, settled);
  Result result = Result::kInexact;
  if (rows == RowResult::kConflict) result = Result::kConflict;
  if (rows == RowResult::kMet && stationary(metric, problem)) result = Result::kAccepted;
  if (result != Result::kInexact)
    std::copy_n(&Qz_[problem.first_row()], problem.stride() - problem.first_row(),
                &candidate.values[problem.first_row()]);
  return result;
}

/// Q z and the gradient of the Lagrangian of the problem as it was given, and the magnitudes of their terms.
void Refinement::evaluate_residuals(const Metric& metric, const ScaledProblem& problem,
                                    const WorkingSet& working_set) {
  const int n = problem.n();
  metric.evaluate(z_, Qz_, terms_);
  double objective_scale = 0;
  for (int j = 0; j < n; ++j) {
    gradient_residual_[j] = Qz_[j] + problem.gamma()[j];
    terms_[j] += std::abs(problem.gamma()[j]);
    objective_scale += std::abs(z_[j]) * terms_[j];
  }
  objective_scale_ = objective_scale;
  for (int i = 0; i < working_set.size(); ++i) {
    const int k = working_set.constraint(i);
    const double lambda = working_set.multiplier(i);
    if (k < problem.first_row()) {
      gradient_residual_[k] += lambda;
      terms_[k] += std::abs(lambda);
      continue;
    }
    for (int j = 0; j < n; ++j) {
      const double term = metric.q(j)[k] * lambda;
      gradient_residual_[j] += term;
      terms_[j] += std::abs(term);
    }
  }
}

/// Whether the rows are met: those of the working set at their bounds, the others within.
Refinement::RowResult Refinement::check_rows(const Metric& metric, const ScaledProblem& problem,
                                             const WorkingSet& working_set, const Candidate& candidate,
                                             double settled) {
  const int first = problem.first_row(), end = first + problem.rows();
  Values residual;
  bool met = true, loosely_met = true;
  const double rounding = kRounding * candidate.term_sum;
  // A row whose bound is zero, and that is this small, consists of rounding errors.
  const auto negligible = [&](int k) {
    return Qz_[k] == residual[k] && terms_[k] <= kNegligible * row_scale(metric, problem, k);
  };
  for (int k = first; k < end; k += kSimdRows)
    store(&residual[k], bound_violation(load(&Qz_[k]), load(&problem.lower()[k]), load(&problem.upper()[k])));
  for (int i = 0; i < working_set.size(); ++i) {
    const int k = working_set.constraint(i);
    if (k < first) continue;
    residual[k] = Qz_[k] - candidate.values[k];
    // The residual changes the objective by λ_k times as much.
    const double lambda = std::abs(working_set.multiplier(i)), price = std::abs(residual[k]) * lambda;
    met = met && (negligible(k) || price <= kRowAccuracy * objective_scale_);
    loosely_met =
        loosely_met && (negligible(k) || price <= kRowAccuracy * objective_scale_ + rounding * lambda);
  }
  double largest = 0, change = 0;
  for (int k = first; k < end; ++k) {
    const double distance = std::abs(residual[k]);
    const double terms = terms_[k] + std::abs(Qz_[k] - residual[k]) + problem.relaxation(k);
    if (!negligible(k)) {
      met = met && distance <= kRowAccuracy * terms;
      loosely_met =
          loosely_met && (distance <= std::clamp(rounding, kRowAccuracy * terms, kLooseAccuracy * terms) ||
                          // Near zero, rounding of the multipliers exceeds any share of the terms.
                          (distance <= rounding && distance <= kNegligible * row_scale(metric, problem, k)));
    }
    change = std::max(change, std::abs(residual[k] - row_residual_[k]));
    largest = std::max(largest, distance);
    row_residual_[k] = residual[k];
  }
  const bool stalled = largest > max_row_residual_ / 2;
  stalls_ += stalled;
  max_row_residual_ = largest;
  if (met || (loosely_met && (stalled || stalls_ >= kMaxStalls))) return RowResult::kMet;
  return change <= settled * largest ? RowResult::kConflict : RowResult::kMissed;
}

/// Whether the gradient of the Lagrangian vanishes: relative to the candidate, or, where rounding forbids
/// that, relative to γ, which is far larger where H is nearly singular. Its square in the metric bounds twice
/// the excess of the objective.
bool Refinement::stationary(const Metric& metric, const ScaledProblem& problem) {
  double square = 0, terms = 0, z_max = 0, energy = 0;
  for (int j = 0; j < problem.n(); ++j) {
    const double* gram = metric.gram(j);
    double sum = 0;
    for (int i = 0; i < problem.n(); ++i) sum += gram[i] * gradient_residual_[i];
    square += sum * gradient_residual_[j];
    terms += terms_[j];
    z_max = std::max(z_max, std::abs(z_[j]));
    const int k = metric.first_energy_row() + j;
    energy += energy_weight_ * z_[j] * metric.unit(j) * Qz_[k] * metric.unit(k);
  }
  const double length = std::sqrt(square), before = gradient_norm_;
  gradient_norm_ = length;
  const double wanted = energy_weight_ > 0 ? kEnergyAccuracy * std::sqrt(energy) : kStationarity * z_max;
  if (length <= wanted || length <= problem.n() * kRounding * terms) return true;
  return length > before / 2 &&
         length <= kStationarity * std::max(z_max, problem.gamma_max()) + kRounding * terms;
}

void Refinement::correct(const Metric& metric, ScaledProblem& problem, const Candidate& candidate) noexcept {
  const int stride = problem.stride();
  for (int k = problem.first_row(); k < stride; k += kSimdRows) {
    const Simd residual = load(&Qz_[k]) - load(&candidate.values[k]);
    problem.correct_rows(k, residual);
    store(&row_correction_[k], load(&row_correction_[k]) + residual);
  }
  problem.correct_gradient(metric, gradient_residual_);
}

void Refinement::drop_corrections(ScaledProblem& problem) noexcept {
  max_row_residual_ = gradient_norm_ = std::numeric_limits<double>::infinity();
  stalls_ = 0;
  for (int k = problem.first_row(); k < problem.stride(); k += kSimdRows) {
    problem.correct_rows(k, -load(&row_correction_[k]));
    store(&row_correction_[k], Simd{});
    store(&row_residual_[k], Simd{});
  }
}

}  // namespace tendril::qp
