// SPDX-License-Identifier: Apache-2.0
// Products A Bᵀ of panels, in tiles that stay in registers, for the kernel sources alone: see simd.h.
#pragma once

#include "fem/sparse/front_kernels.h"

namespace tendril::fem {
namespace {

#if defined(__AVX512F__)
constexpr int kPacketSize = 8;
constexpr int kTilePanels = 3, kTileColumns = 8;  // 24 of the 32 registers sum up
#elif defined(__AVX__)
constexpr int kPacketSize = 4;
constexpr int kTilePanels = 1, kTileColumns = 4;  // 8 of 16; six columns would fit but do not divide a panel
#else
constexpr int kPacketSize = 2;
constexpr int kTilePanels = 1, kTileColumns = 2;
#endif
typedef double Packet __attribute__((vector_size(kPacketSize * sizeof(double)), may_alias));
constexpr int kPanelPackets = kSimdRows / kPacketSize;  // in a panel

// Pivots that are eliminated before the columns to their right are updated: a panel of so many columns and a
// tile fit in the first-level cache.
constexpr int kPivotBlock = 96;
// Columns that are updated in one loop over the rows: so many panels of a pivot block fit in the second-level
// cache.
constexpr int kColumnBlock = 192;

inline Packet broadcast(double a) { return Packet{} + a; }
inline const Packet* packets(const double* p) { return reinterpret_cast<const Packet*>(p); }
inline Packet* packets(double* p) { return reinterpret_cast<Packet*>(p); }

/// Sums of a tile of `kS` panels by `kC` columns.
template <int kS, int kC>
struct Tile {
  Packet sum[kS * kPanelPackets][kC];

  /// sum ← C, whose columns are ld apart; columns from `columns` on, and all where `zero`, start at zero.
  __attribute__((always_inline)) void load(const double* C, int ld, int columns, bool zero) {
#pragma GCC unroll 16
    for (int c = 0; c < kC; ++c)
#pragma GCC unroll 16
      for (int v = 0; v < kS * kPanelPackets; ++v)
        sum[v][c] = zero || c >= columns ? Packet{} : packets(C + c * static_cast<long>(ld))[v];
  }

  __attribute__((always_inline)) void store(double* C, int ld, int columns) const {
#pragma GCC unroll 16
    for (int c = 0; c < kC; ++c)
      if (c < columns)
#pragma GCC unroll 16
        for (int v = 0; v < kS * kPanelPackets; ++v) packets(C + c * static_cast<long>(ld))[v] = sum[v][c];
  }

  /// sum ← sum − A Bᵀ over `depth` columns of panels A, `stride` apart, and rows of panel B.
  __attribute__((always_inline)) void subtract(const double* A, long stride, const double* B, int depth) {
    for (int p = 0; p < depth; ++p, A += kSimdRows, B += kSimdRows) {
      Packet a[kS * kPanelPackets];
#pragma GCC unroll 16
      for (int v = 0; v < kS * kPanelPackets; ++v)
        a[v] = packets(A + (v / kPanelPackets) * stride)[v % kPanelPackets];
#pragma GCC unroll 16
      for (int c = 0; c < kC; ++c) {
        const Packet b = broadcast(B[c]);
#pragma GCC unroll 16
        for (int v = 0; v < kS * kPanelPackets; ++v) sum[v][c] -= a[v] * b;
      }
    }
  }
};

/// C ← C − A Bᵀ for `panels` panels of A, `stride` apart, and `columns` ≤ 8 rows of panel B.
template <int kS>
inline void update_tile(const double* A, long stride, const double* B, int depth, double* C, int ld,
                        int columns, bool zero) {
#pragma GCC unroll 4
  for (int c = 0; c < kSimdRows; c += kTileColumns) {
    if (c >= columns) return;
    Tile<kS, kTileColumns> tile;
    tile.load(C + c * static_cast<long>(ld), ld, columns - c, zero);
    tile.subtract(A, stride, B + c, depth);
    tile.store(C + c * static_cast<long>(ld), ld, columns - c);
  }
}

void update_rows(const double* A, long stride, int panels, const double* B, int depth, double* C, int ld,
                 int columns, bool zero) {
  int s = 0;
  for (; s + kTilePanels <= panels; s += kTilePanels)
    update_tile<kTilePanels>(A + s * stride, stride, B, depth, C + s * kSimdRows, ld, columns, zero);
  for (; s < panels; ++s)
    update_tile<1>(A + s * stride, stride, B, depth, C + s * kSimdRows, ld, columns, zero);
}

/// Lower triangle of C ← C − A Aᵀ in whole panels, for rows and columns from the same panels on. Columns are
/// processed in groups, so that their panels of A remain in the cache during the loop over the rows.
void update_lower(const double* A, long stride, int panels, int depth, double* C, int ld, int columns,
                  bool zero) {
  constexpr int kGroup = kColumnBlock / kSimdRows;
  const int column_panels = (columns + kSimdRows - 1) / kSimdRows;
  for (int first = 0; first < column_panels; first += kGroup) {
    const int last = first + kGroup < column_panels ? first + kGroup : column_panels;
    for (int s = first; s < panels; s += kTilePanels) {
      const int rows = panels - s < kTilePanels ? panels - s : kTilePanels;
      for (int j = first; j < last && j < s + rows; ++j) {
        const int left = columns - j * kSimdRows;
        update_rows(A + s * stride, stride, rows, A + j * stride, depth,
                    C + j * kSimdRows * static_cast<long>(ld) + s * kSimdRows, ld,
                    left < kSimdRows ? left : kSimdRows, zero);
      }
    }
  }
}

}  // namespace
}  // namespace tendril::fem
