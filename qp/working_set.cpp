// SPDX-License-Identifier: Apache-2.0
#include "qp/working_set.h"

#include <algorithm>

namespace tendril::qp {
namespace {

// Pivots are sums of squares of size one: what lies below this is rounding.
constexpr double kLeastPivot = 1e-12;

/// Product of the first i entries of a row of L, padded with zeros, with those of v.
inline double dot(const double* row, const double* v, int i) {
  Simd products = {};
  for (int j = 0; j < i; j += kSimdRows) products += load(row + j) * load(v + j);
  return reduce_sum(products);
}

}  // namespace

void WorkingSet::clear() noexcept {
  // SIMD vectors reach beyond the last entry, where zero times a number that is not finite would not be zero.
  for (int i = 0; i < size_; ++i) multiplier_[i] = reciprocal_[i] = forward_[i] = 0;
  size_ = updates_ = solved_ = 0;
}

void WorkingSet::add(const Metric& metric, int k, Side side) noexcept {
  const double* gram = metric.gram(k);
  double* l = row(size_);
  const int padded = round_up_to_simd(size_);
  for (int i = 0; i < padded; i += kSimdRows) store(l + i, Simd{});
  for (int i = 0; i < size_; ++i) l[i] = gram[constraint_[i]] - dot(row(i), l, i);
  Simd products = {};
  for (int i = 0; i < padded; i += kSimdRows) {
    const Simd before = load(l + i), after = before * load(reciprocal_.data() + i);
    products += before * after;
    store(l + i, after);
  }
  const double pivot = std::max(gram[k] + metric.softness(k) - reduce_sum(products), kLeastPivot);
  pivot_[size_] = pivot;
  reciprocal_[size_] = 1 / pivot;
  constraint_[size_] = k;
  side_[size_] = side;
  multiplier_[size_] = 0;
  ++size_;
  ++updates_;
}

void WorkingSet::drop(int dropped) noexcept {
  // Without row and column `dropped`, the rows below lose the product of the column with its pivot; adding it
  // back to their factor is the update L D Lᵀ + α w wᵀ.  [Gill et al. 1974, C1]
  Values factor, beta;
  double alpha = pivot_[dropped];
  for (int i = dropped + 1; i < size_; ++i) {
    const double* from = row(i);
    double* to = row(i - 1);
    // Row i - 1 of the smaller factor: what is right of it was updated by the rows above.
    double p = from[dropped];
    std::copy(from, from + dropped, to);
    for (int j = dropped; j < i - 1; ++j) {
      const double l = from[j + 1];
      p -= factor[j] * l;
      to[j] = l + beta[j] * p;
    }
    const double before = pivot_[i], after = before + alpha * p * p;
    factor[i - 1] = p;
    beta[i - 1] = alpha * p / after;
    alpha *= before / after;
    pivot_[i - 1] = after;
    reciprocal_[i - 1] = 1 / after;
    std::fill(to + (i - 1), to + round_up_to_simd(i - 1), 0.0);
    constraint_[i - 1] = constraint_[i];
    side_[i - 1] = side_[i];
    multiplier_[i - 1] = multiplier_[i];
  }
  --size_;
  multiplier_[size_] = reciprocal_[size_] = forward_[size_] = 0;
  ++updates_;
  solved_ = std::min(solved_, dropped);
}

void WorkingSet::refactor(const Metric& metric) noexcept {
  const int size = size_;
  size_ = 0;
  while (size_ < size) {
    const double multiplier = multiplier_[size_];
    add(metric, constraint_[size_], side_[size_]);
    multiplier_[size_ - 1] = multiplier;
  }
  updates_ = solved_ = 0;
}

void WorkingSet::forward_substitute(int i, double b) noexcept {
  forward_[i] = b - dot(row(i), forward_.data(), i);
}

int WorkingSet::step() noexcept {
  alignas(32) Values target;
  const int padded = round_up_to_simd(size_);
  for (int i = 0; i < padded; i += kSimdRows)
    store(target.data() + i, load(forward_.data() + i) * load(reciprocal_.data() + i));
  for (int i = size_ - 1; i > 0; --i) {
    const double* l = row(i);
    for (int j = 0; j < i; j += kSimdRows) store(&target[j], load(&target[j]) - load(l + j) * target[i]);
  }

  int blocking = -1;
  double step = 1;
  for (int i = 0; i < size_; ++i) {
    if (static_cast<double>(side_[i]) * target[i] >= 0) continue;
    const double limit = multiplier_[i] / (multiplier_[i] - target[i]);
    if (blocking < 0 || limit < step) step = limit, blocking = i;
  }
  for (int i = 0; i < padded; i += kSimdRows) {
    const Simd from = load(&multiplier_[i]);
    store(&multiplier_[i], blocking < 0 ? load(&target[i]) : from + step * (load(&target[i]) - from));
  }
  if (blocking >= 0) multiplier_[blocking] = 0;
  return blocking;
}

}  // namespace tendril::qp
