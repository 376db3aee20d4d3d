// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "qp/metric.h"

namespace tendril::qp {

/// result = values − Σ_i coefficient_i (column of G for constraint number(i)), i = 0..count-1; values may be
/// nullptr, for zeros.
/// Real-time: yes, 2 stride() operations for each i.
template <typename Number>
inline void subtract_columns(const Metric& metric, int count, const Number& number,
                             const double* coefficients, const double* values, double* result) {
  const int stride = metric.stride();
  int k = 0;
  const auto sweep = [&]<int kVectors>() {
    Simd sums[kVectors];
    for (int s = 0; s < kVectors; ++s) sums[s] = values ? load(values + k + s * kSimdRows) : Simd{};
#pragma GCC unroll 2
    for (int i = 0; i < count; ++i) {
      const double* column = metric.gram(number(i)) + k;
      const Simd coefficient = broadcast(coefficients[i]);
#pragma GCC unroll 4
      for (int s = 0; s < kVectors; ++s) sums[s] -= load(column + s * kSimdRows) * coefficient;
    }
    for (int s = 0; s < kVectors; ++s) store(result + k + s * kSimdRows, sums[s]);
    k += kVectors * kSimdRows;
  };
  while (k + 4 * kSimdRows <= stride) sweep.template operator()<4>();
  if (k < stride) sweep.template operator()<2>();  // stride() is even in SIMD vectors
}

}  // namespace tendril::qp
