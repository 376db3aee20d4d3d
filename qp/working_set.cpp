#include "qp/working_set.h"

#include <algorithm>

namespace tendril::qp {
namespace {

// Pivots are sums of squares of size one: what lies below this is rounding.
constexpr double kLeastPivot = 1e-12;

}  // namespace

void WorkingSet::add(const Metric& metric, int k, Side side) noexcept {
  const double* gram = metric.gram(k);
  double* l = row(size_);
  double pivot = gram[k] + metric.softness(k);
  for (int i = 0; i < size_; ++i) {
    const double* li = row(i);
    double value = gram[constraint_[i]];
    for (int j = 0; j < i; ++j) value -= li[j] * l[j];
    l[i] = value;
  }
  for (int i = 0; i < size_; ++i) {
    const double value = l[i];
    l[i] = value / pivot_[i];
    pivot -= value * l[i];
  }
  pivot_[size_] = std::max(pivot, kLeastPivot);
  constraint_[size_] = k;
  side_[size_] = side;
  multiplier_[size_] = 0;
  ++size_;
  ++updates_;
}

void WorkingSet::drop(int dropped) noexcept {
  // Without row and column `dropped`, the rows below lose the product of the column with its pivot; adding it
  // back to their factor is the update L D Lᵀ + α w wᵀ.  [Gill et al. 1974, C1]
  std::array<double, kMaxConstraints> w;
  double alpha = pivot_[dropped];
  for (int i = dropped + 1; i < size_; ++i) {
    const double* from = row(i);
    double* to = row(i - 1);
    w[i - 1] = from[dropped];
    std::copy(from, from + dropped, to);
    std::copy(from + dropped + 1, from + i, to + dropped);
    pivot_[i - 1] = pivot_[i];
    constraint_[i - 1] = constraint_[i];
    side_[i - 1] = side_[i];
    multiplier_[i - 1] = multiplier_[i];
  }
  --size_;
  ++updates_;
  for (int j = dropped; j < size_; ++j) {
    const double p = w[j], before = pivot_[j];
    pivot_[j] += alpha * p * p;
    const double beta = alpha * p / pivot_[j];
    alpha *= before / pivot_[j];
    for (int i = j + 1; i < size_; ++i) {
      double* l = row(i) + j;
      w[i] -= p * *l;
      *l += beta * w[i];
    }
  }
}

void WorkingSet::refactor(const Metric& metric) noexcept {
  const int size = size_;
  size_ = 0;
  while (size_ < size) {
    const double multiplier = multiplier_[size_];
    add(metric, constraint_[size_], side_[size_]);
    multiplier_[size_ - 1] = multiplier;
  }
  updates_ = 0;
}

int WorkingSet::move_towards(const double* b) noexcept {
  std::array<double, kMaxConstraints> target;
  for (int i = 0; i < size_; ++i) {
    const double* l = row(i);
    target[i] = b[i];
    for (int j = 0; j < i; ++j) target[i] -= l[j] * target[j];
  }
  for (int i = 0; i < size_; ++i) target[i] /= pivot_[i];
  for (int i = size_ - 1; i > 0; --i) {
    const double* l = row(i);
    for (int j = 0; j < i; ++j) target[j] -= l[j] * target[i];
  }

  int blocking = -1;
  double step = 1;
  for (int i = 0; i < size_; ++i) {
    if (static_cast<double>(side_[i]) * target[i] >= 0) continue;
    const double limit = multiplier_[i] / (multiplier_[i] - target[i]);
    if (blocking < 0 || limit < step) step = limit, blocking = i;
  }
  if (blocking < 0) {
    std::copy_n(target.begin(), size_, multiplier_.begin());
  } else {
    for (int i = 0; i < size_; ++i) multiplier_[i] += step * (target[i] - multiplier_[i]);
    multiplier_[blocking] = 0;
  }
  return blocking;
}

}  // namespace tendril::qp
