// SPDX-License-Identifier: Apache-2.0
#include "qp/scaled_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "qp/gram_product.h"

namespace tendril::qp {

void ScaledProblem::set_gradient(const Metric& metric, const Vector& g) noexcept {
  n_ = metric.n();
  rows_ = metric.rows();
  first_row_ = metric.first_row();
  stride_ = metric.stride();
  Simd most{}, terms{};
  for (int j = 0; j < first_row_; j += kSimdRows) {
    const Simd gamma = load_partial(g.data() + j, n_ - j) * load(metric.unit() + j);
    store(&gamma_[j], gamma);
    most = max(most, abs(gamma));
    terms += abs(gamma);
  }
  gamma_max_ = reduce_max(most);
  gamma_sum_ = reduce_sum(terms);
  subtract_columns(
      metric, n_, [](int j) { return j; }, gamma_.data(), nullptr, start_.data());
}

bool ScaledProblem::minimum_meets(const Metric& metric, const Bounds& bounds) const noexcept {
  SimdMask met = Simd{} == Simd{};
  const auto check = [&](const double* lower, const double* upper, int count, int k) {
    const Simd value = load(&start_[k]) * load(metric.unit() + k);
    met &= (load_partial(lower, count) <= value) & (value <= load_partial(upper, count));
  };
  for (int j = 0; j < n_; j += kSimdRows) check(&bounds.lower[j], &bounds.upper[j], n_ - j, j);
  for (int i = 0; i < rows_; i += kSimdRows)
    check(&bounds.row_lower[i], &bounds.row_upper[i], rows_ - i, first_row_ + i);
  return reduce_and(met);
}

bool ScaledProblem::set_bounds(const Metric& metric, const Bounds& bounds) noexcept {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  SimdMask valid = Simd{} == Simd{};
  Simd size{};
  const auto take = [&](const double* lower, const double* upper, int count, int k) {
    const Simd weight = load(metric.weight() + k), value = load(&start_[k]);
    const Simd l = load_partial(lower, count) * weight;
    const Simd u = load_partial(upper, count) * weight;
    valid &= (l <= u) & (l < broadcast(kInfinity)) & (u > broadcast(-kInfinity));
    size = max(size, abs(min(max(value, l), u)));
    store(&lower_[k], l);
    store(&upper_[k], u);
  };
  for (int j = 0; j < first_row_; j += kSimdRows)
    take(bounds.lower.data() + j, bounds.upper.data() + j, n_ - j, j);
  for (int i = 0; first_row_ + i < stride_; i += kSimdRows)
    take(bounds.row_lower.data() + i, bounds.row_upper.data() + i, rows_ - i, first_row_ + i);
  value_max_ = reduce_max(size);
  relaxed_ = false;
  return reduce_and(valid) && gamma_sum_ < kInfinity;
}

void ScaledProblem::add_to_gamma(const Metric& metric, const Values& change) noexcept {
  gamma_max_ = gamma_sum_ = 0;
  for (int j = 0; j < n_; ++j) {
    gamma_[j] += change[j];
    gamma_max_ = std::max(gamma_max_, std::abs(gamma_[j]));
    gamma_sum_ += std::abs(gamma_[j]);
  }
  correct_gradient(metric, change);
}

void ScaledProblem::correct_gradient(const Metric& metric, const Values& change) noexcept {
  subtract_columns(
      metric, n_, [](int j) { return j; }, change.data(), start_.data(), start_.data());
}

void ScaledProblem::relax(int k, double violation) noexcept {
  if (!relaxed_) relaxation_.fill(0);
  relaxed_ = true;
  relaxation_[k] += std::abs(violation);
  const bool equality = lower_[k] == upper_[k];
  if (violation < 0 || equality) lower_[k] += violation;
  if (violation > 0 || equality) upper_[k] += violation;
}

}  // namespace tendril::qp
