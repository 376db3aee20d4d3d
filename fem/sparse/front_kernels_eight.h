// Substitution with a front's factor in single precision, eight right sides at once, for the kernel bodies
// alone: see simd.h. Each number of L meets eight of the right sides, and L is read in the order in which it
// lies in memory, strip after strip.
#pragma once

#include "fem/sparse/front_kernels.h"

namespace tendril::fem {
namespace {

using Eight = float __attribute__((vector_size(8 * sizeof(float)), may_alias));

inline const Eight* eights(const float* p) { return reinterpret_cast<const Eight*>(p); }
inline Eight* eights(float* p) { return reinterpret_cast<Eight*>(p); }

/// z ← z − L y for one strip of L and the first `columns` rows of y; z has the strip's eight rows.
inline void subtract_strip(const float* L, int columns, const Eight* y, Eight* z) {
  Eight sum[kStrip];
  for (int i = 0; i < kStrip; ++i) sum[i] = z[i];
  for (int p = 0; p < columns; ++p, L += kStrip) {
    const Eight y_p = y[p];
#pragma GCC unroll 8
    for (int i = 0; i < kStrip; ++i) sum[i] -= L[i] * y_p;
  }
  for (int i = 0; i < kStrip; ++i) z[i] = sum[i];
}

/// x ← x − Lᵀ z for one strip of L and the first `columns` rows of x; z has the strip's eight rows.
inline void subtract_transposed_strip(const float* L, int columns, const Eight* z, Eight* x) {
  Eight rows[kStrip];
  for (int i = 0; i < kStrip; ++i) rows[i] = z[i];
  for (int p = 0; p < columns; ++p, L += kStrip) {
    Eight even = x[p], odd = Eight{};  // two chains of sums, neither of which waits for the other
#pragma GCC unroll 4
    for (int i = 0; i < kStrip; i += 2) {
      even -= L[i] * rows[i];
      odd -= L[i + 1] * rows[i + 1];
    }
    x[p] = even + odd;
  }
}

void forward_eight(const float* L, int k, int n, float* numbers) noexcept {
  const long stride = static_cast<long>(k) * kStrip;
  const int pivot_strips = (k + kStrip - 1) / kStrip, stay_strips = (n + kStrip - 1) / kStrip;
  Eight* z = eights(numbers);
  for (int s = 0; s < pivot_strips; ++s) {
    const int b = s * kStrip, columns = k - b < kStrip ? k - b : kStrip;
    const float* strip = L + s * stride;
    subtract_strip(strip, b, z, z + b);
    const float* diagonal = strip + b * kStrip;
    for (int c = 0; c < columns; ++c, diagonal += kStrip) {
      z[b + c] *= 1 / diagonal[c];
      for (int i = c + 1; i < columns; ++i) z[b + i] -= diagonal[i] * z[b + c];
    }
  }
  Eight* stay = z + pivot_strips * kStrip;
  for (int s = 0; s < stay_strips; ++s) {
    for (int i = 0; i < kStrip; ++i) stay[s * kStrip + i] = Eight{};
    subtract_strip(L + (pivot_strips + s) * stride, k, z, stay + s * kStrip);
  }
}

void backward_eight(const float* L, int k, int n, float* numbers) noexcept {
  const long stride = static_cast<long>(k) * kStrip;
  const int pivot_strips = (k + kStrip - 1) / kStrip, stay_strips = (n + kStrip - 1) / kStrip;
  Eight* z = eights(numbers);
  for (int s = pivot_strips + stay_strips - 1; s >= pivot_strips; --s)
    subtract_transposed_strip(L + s * stride, k, z + s * kStrip, z);
  for (int s = pivot_strips - 1; s >= 0; --s) {
    const int b = s * kStrip, columns = k - b < kStrip ? k - b : kStrip;
    const float* strip = L + s * stride;
    for (int c = columns - 1; c >= 0; --c) {
      const float* column = strip + (b + c) * kStrip;
      for (int i = c + 1; i < columns; ++i) z[b + c] -= column[i] * z[b + i];
      z[b + c] *= 1 / column[c];
    }
    subtract_transposed_strip(strip, b, z + b, z);
  }
}

}  // namespace
}  // namespace tendril::fem
