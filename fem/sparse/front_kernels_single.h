// SPDX-License-Identifier: Apache-2.0
// Substitution with a front's factor in single precision for eight right-hand sides, for the kernel sources
// alone: see simd.h. Each number of L meets eight numbers, and L is read in the order of memory, panel after
// panel.
#pragma once

#include "fem/sparse/front_kernels.h"

namespace tendril::fem {
namespace {

using Packet8f = float __attribute__((vector_size(8 * sizeof(float)), may_alias));

inline const Packet8f* packets8f(const float* p) { return reinterpret_cast<const Packet8f*>(p); }
inline Packet8f* packets8f(float* p) { return reinterpret_cast<Packet8f*>(p); }

/// z ← z − L y for one panel of L and the first `columns` rows of y; z has the panel's eight rows.
inline void subtract_panel(const float* L, int columns, const Packet8f* y, Packet8f* z) {
  Packet8f sum[kSimdRows];
  for (int i = 0; i < kSimdRows; ++i) sum[i] = z[i];
  for (int p = 0; p < columns; ++p, L += kSimdRows) {
    const Packet8f y_p = y[p];
#pragma GCC unroll 8
    for (int i = 0; i < kSimdRows; ++i) sum[i] -= L[i] * y_p;
  }
  for (int i = 0; i < kSimdRows; ++i) z[i] = sum[i];
}

/// x ← x − Lᵀ z for one panel of L and the first `columns` rows of x; z has the panel's eight rows.
inline void subtract_transposed_panel(const float* L, int columns, const Packet8f* z, Packet8f* x) {
  Packet8f rows[kSimdRows];
  for (int i = 0; i < kSimdRows; ++i) rows[i] = z[i];
  for (int p = 0; p < columns; ++p, L += kSimdRows) {
    Packet8f even = x[p], odd = Packet8f{};  // two chains of sums, neither of which waits for the other
#pragma GCC unroll 4
    for (int i = 0; i < kSimdRows; i += 2) {
      even -= L[i] * rows[i];
      odd -= L[i + 1] * rows[i + 1];
    }
    x[p] = even + odd;
  }
}

void forward_substitute_eight(const float* L, int k, int n, float* numbers) noexcept {
  const long stride = static_cast<long>(k) * kSimdRows;
  const int pivot_panels = (k + kSimdRows - 1) / kSimdRows, update_panels = (n + kSimdRows - 1) / kSimdRows;
  Packet8f* z = packets8f(numbers);
  for (int s = 0; s < pivot_panels; ++s) {
    const int b = s * kSimdRows, columns = k - b < kSimdRows ? k - b : kSimdRows;
    const float* panel = L + s * stride;
    subtract_panel(panel, b, z, z + b);
    const float* diagonal = panel + b * kSimdRows;
    for (int c = 0; c < columns; ++c, diagonal += kSimdRows) {
      z[b + c] *= 1 / diagonal[c];
      for (int i = c + 1; i < columns; ++i) z[b + i] -= diagonal[i] * z[b + c];
    }
  }
  Packet8f* update = z + pivot_panels * kSimdRows;
  for (int s = 0; s < update_panels; ++s) {
    for (int i = 0; i < kSimdRows; ++i) update[s * kSimdRows + i] = Packet8f{};
    subtract_panel(L + (pivot_panels + s) * stride, k, z, update + s * kSimdRows);
  }
}

void backward_substitute_eight(const float* L, int k, int n, float* numbers) noexcept {
  const long stride = static_cast<long>(k) * kSimdRows;
  const int pivot_panels = (k + kSimdRows - 1) / kSimdRows, update_panels = (n + kSimdRows - 1) / kSimdRows;
  Packet8f* z = packets8f(numbers);
  for (int s = pivot_panels + update_panels - 1; s >= pivot_panels; --s)
    subtract_transposed_panel(L + s * stride, k, z + s * kSimdRows, z);
  for (int s = pivot_panels - 1; s >= 0; --s) {
    const int b = s * kSimdRows, columns = k - b < kSimdRows ? k - b : kSimdRows;
    const float* panel = L + s * stride;
    for (int c = columns - 1; c >= 0; --c) {
      const float* column = panel + (b + c) * kSimdRows;
      for (int i = c + 1; i < columns; ++i) z[b + c] -= column[i] * z[b + i];
      z[b + c] *= 1 / column[c];
    }
    subtract_transposed_panel(panel, b, z + b, z);
  }
}

}  // namespace
}  // namespace tendril::fem
