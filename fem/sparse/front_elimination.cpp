// SPDX-License-Identifier: Apache-2.0
// The kernels of front_kernels.h. Compiled once for each instruction set: see simd.h for what may not be used
// here.

#include "fem/sparse/front_kernels.h"
#include "fem/sparse/front_kernels_single.h"
#include "fem/sparse/front_kernels_tile.h"

#ifdef __AVX512F__
#include <immintrin.h>  // its functions are always inlined
#endif

namespace tendril::fem {
namespace {

/// target[b] += the next source, for each bit b of the mask.
inline void add_expanded(double* target, const double* source, unsigned mask) {
#ifdef __AVX512F__
  const __m512d more = _mm512_maskz_expandloadu_pd(static_cast<__mmask8>(mask), source);
  _mm512_store_pd(target, _mm512_add_pd(_mm512_load_pd(target), more));
#else
  for (; mask; mask &= mask - 1) target[__builtin_ctz(mask)] += *source++;
#endif
}

void extend_add(const double* U, int ldu, const RowMap* map, int count, const Front& parent) noexcept {
  const int update_begin = round_up_to_panel(parent.k);
  for (int a = 0; a < count; ++a) {
    int from = map[a].from;
    for (unsigned left = map[a].mask; left; left &= left - 1, ++from) {
      const int to = map[a].to + __builtin_ctz(left);
      const double* source = U + from * static_cast<long>(ldu);
      const bool in_F = to < update_begin;
      double* target = in_F ? parent.F + to * static_cast<long>(parent.ld)
                            : parent.U + (to - update_begin) * static_cast<long>(parent.ldu);
      const int above = in_F ? 0 : update_begin;  // rows of the front before the target's first
      add_expanded(target + (map[a].to - above), source + from, left);
      for (int b = a + 1; b < count; ++b)
        add_expanded(target + (map[b].to - above), source + map[b].from, map[b].mask);
    }
  }
}

/// Cholesky of the triangle of a diagonal block: `columns` ≤ 8 columns of a panel of L, in place; what lies
/// above the diagonal becomes zero. The reciprocals of the pivots are given too.
///
/// Eliminates first and takes the roots afterwards, so that no pivot waits for the root of the one before.
bool factor_diagonal(double* L, int columns, double* reciprocal) {
  double pivots[kSimdRows];
  for (int c = 0; c < columns; ++c) {
    const double* column = L + c * kSimdRows;
    const double pivot = column[c];
    if (!(pivot > 0) || !(pivot < __builtin_inf())) return false;
    pivots[c] = pivot;
    const Packet factor = broadcast(1 / pivot);
    Packet scaled[kPanelPackets];
    for (int v = 0; v < kPanelPackets; ++v) scaled[v] = packets(column)[v] * factor;
    for (int j = c + 1; j < columns; ++j) {
      const Packet b = broadcast(column[j]);
      for (int v = 0; v < kPanelPackets; ++v) packets(L + j * kSimdRows)[v] -= scaled[v] * b;
    }
  }
  for (int c = 0; c < columns; ++c) reciprocal[c] = 1 / __builtin_sqrt(pivots[c]);
  for (int c = 0; c < columns; ++c) {
    double* column = L + c * kSimdRows;
    const Packet r = broadcast(reciprocal[c]);
    for (int v = 0; v < kPanelPackets; ++v) packets(column)[v] *= r;
    for (int i = 0; i < c; ++i) column[i] = 0;
  }
  return true;
}

/// X ← X L⁻ᵀ for panels X of eight columns at most, with L a factored diagonal block.
template <int kS>
__attribute__((always_inline)) inline void solve_tile(Tile<kS, kSimdRows>& X, const double* L, int columns,
                                                      const double* reciprocal) {
#pragma GCC unroll 8
  for (int c = 0; c < kSimdRows; ++c) {
    if (c >= columns) break;
    const Packet r = broadcast(reciprocal[c]);
#pragma GCC unroll 16
    for (int v = 0; v < kS * kPanelPackets; ++v) X.sum[v][c] *= r;
#pragma GCC unroll 8
    for (int j = c + 1; j < kSimdRows; ++j) {
      const Packet b = broadcast(L[c * kSimdRows + j]);
#pragma GCC unroll 16
      for (int v = 0; v < kS * kPanelPackets; ++v) X.sum[v][j] -= X.sum[v][c] * b;
    }
  }
}

/// Panels of L below a diagonal block: F − (earlier columns of the pivot block) · (rows of the block)ᵀ, then
/// times L⁻ᵀ.
template <int kS>
inline void eliminate_tile(const double* F, int ld, const double* A, long stride, const double* B, int depth,
                           const double* diagonal, int columns, const double* reciprocal, double* L) {
  Tile<kS, kSimdRows> tile;
  if constexpr (kTileColumns == kSimdRows) {
    tile.load(F, ld, columns, false);
    tile.subtract(A, stride, B, depth);
  } else {  // too few registers for all columns at once
    static_assert(kS == 1);
    alignas(64) double block[kSimdRows * kSimdRows] = {};
    for (int c = 0; c < columns; c += kTileColumns) {
      Tile<kS, kTileColumns> part;
      part.load(F + c * static_cast<long>(ld), ld, columns - c, false);
      part.subtract(A, stride, B + c, depth);
      part.store(block + c * kSimdRows, kSimdRows, kTileColumns);
    }
    tile.load(block, kSimdRows, kSimdRows, false);
  }
  solve_tile<kS>(tile, diagonal, columns, reciprocal);
#pragma GCC unroll 16
  for (int c = 0; c < kSimdRows; ++c)
    if (c < columns)
#pragma GCC unroll 16
      for (int v = 0; v < kS * kPanelPackets; ++v)
        packets(L + (v / kPanelPackets) * stride + c * kSimdRows)[v % kPanelPackets] = tile.sum[v][c];
}

/// Eliminates the pivots from `begin` to `end`, at most kPivotBlock; columns before `begin` have been dealt
/// with.
bool eliminate_block(const Front& f, int panels, int begin, int end) {
  const long stride = static_cast<long>(f.k) * kSimdRows;
  const double* A = f.L + begin * static_cast<long>(kSimdRows);
  for (int b = begin; b < end; b += kSimdRows) {
    const int columns = end - b < kSimdRows ? end - b : kSimdRows;
    const int top = b / kSimdRows, depth = b - begin;
    const double* B = A + top * stride;
    double* diagonal = f.L + top * stride + b * static_cast<long>(kSimdRows);
    const double* F = f.F + b * static_cast<long>(f.ld);
    double reciprocal[kSimdRows];

    for (int c = 0; c < columns; c += kTileColumns) {
      Tile<1, kTileColumns> tile;
      tile.load(F + c * static_cast<long>(f.ld) + b, f.ld, columns - c, false);
      tile.subtract(B, stride, B + c, depth);
      tile.store(diagonal + c * kSimdRows, kSimdRows, columns - c);
    }
    if (!factor_diagonal(diagonal, columns, reciprocal)) return false;

    int s = top + 1;
    for (; s + kTilePanels <= panels; s += kTilePanels)
      eliminate_tile<kTilePanels>(F + s * kSimdRows, f.ld, A + s * stride, stride, B, depth, diagonal,
                                  columns, reciprocal, f.L + s * stride + b * static_cast<long>(kSimdRows));
    for (; s < panels; ++s)
      eliminate_tile<1>(F + s * kSimdRows, f.ld, A + s * stride, stride, B, depth, diagonal, columns,
                        reciprocal, f.L + s * stride + b * static_cast<long>(kSimdRows));
  }
  return true;
}

bool eliminate(const Front& f) noexcept {
  const long stride = static_cast<long>(f.k) * kSimdRows;
  const int pivot_panels = (f.k + kSimdRows - 1) / kSimdRows,
            update_panels = (f.n + kSimdRows - 1) / kSimdRows;
  const int panels = pivot_panels + update_panels;
  for (int begin = 0; begin < f.k; begin += kPivotBlock) {
    const int end = f.k - begin < kPivotBlock ? f.k : begin + kPivotBlock;
    if (!eliminate_block(f, panels, begin, end)) return false;
    const double* A = f.L + begin * static_cast<long>(kSimdRows);
    if (end < f.k) {
      const int s = end / kSimdRows;
      update_lower(A + s * stride, stride, panels - s, end - begin, f.F + end * static_cast<long>(f.ld) + end,
                   f.ld, f.k - end, false);
    }
    update_lower(A + pivot_panels * stride, stride, update_panels, end - begin, f.U, f.ldu,
                 update_panels * kSimdRows, begin == 0 && !f.U_is_set);
  }
  return true;
}

void back_substitute(const Front& f, const double* z, double* x) noexcept {
  const long stride = static_cast<long>(f.k) * kSimdRows;
  const int pivot_panels = (f.k + kSimdRows - 1) / kSimdRows,
            update_panels = (f.n + kSimdRows - 1) / kSimdRows;
  const double* update_L = f.L + pivot_panels * stride;
  for (int b = f.k / kSimdRows * kSimdRows; b >= 0; b -= kSimdRows) {
    const int columns = f.k - b < kSimdRows ? f.k - b : kSimdRows;
    if (columns == 0) continue;
    Packet sum[kSimdRows] = {};
    const auto gather = [&](const double* L, const double* v) {
#pragma GCC unroll 8
      for (int c = 0; c < kSimdRows; ++c) {
        if (c >= columns) break;
#pragma GCC unroll 4
        for (int w = 0; w < kPanelPackets; ++w) sum[c] += packets(L + c * kSimdRows)[w] * packets(v)[w];
      }
    };
    for (int s = 0; s < update_panels; ++s)
      gather(update_L + s * stride + b * static_cast<long>(kSimdRows), z + s * kSimdRows);
    for (int s = b / kSimdRows + 1; s < pivot_panels; ++s)
      gather(f.L + s * stride + b * static_cast<long>(kSimdRows), x + s * kSimdRows);
    const double* diagonal = f.L + (b / kSimdRows) * stride + b * static_cast<long>(kSimdRows);
    for (int c = kSimdRows - 1; c >= 0; --c) {
      if (c >= columns) {
        x[b + c] = 0;
        continue;
      }
      double y = 0;
      for (int l = 0; l < kPacketSize; ++l) y -= sum[c][l];
      for (int i = c + 1; i < columns; ++i) y -= diagonal[c * kSimdRows + i] * x[b + i];
      x[b + c] = y / diagonal[c * kSimdRows + c];
    }
  }
}

}  // namespace

namespace TENDRIL_INSTRUCTION_SET {

extern const FrontKernels kFrontKernels{extend_add, eliminate, back_substitute, forward_substitute_eight,
                                        backward_substitute_eight};

}  // namespace TENDRIL_INSTRUCTION_SET

}  // namespace tendril::fem
