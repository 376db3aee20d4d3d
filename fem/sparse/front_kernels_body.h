// The kernels of front_kernels.h as TENDRIL_FRONT_KERNELS, for the instruction set that the including source
// is compiled for. See simd.h for what may not be used here.

#include "fem/sparse/front_kernels.h"
#include "fem/sparse/front_kernels_eight.h"

#ifdef __AVX512F__
#include <immintrin.h>  // its functions are always inlined
#endif

namespace tendril::fem {
namespace {

#if defined(__AVX512F__)
constexpr int kLanes = 8;
constexpr int kTileStrips = 3, kTileColumns = 8;  // 24 of the 32 registers sum up
#elif defined(__AVX__)
constexpr int kLanes = 4;
constexpr int kTileStrips = 1, kTileColumns = 4;  // 8 of 16; six columns would fit but do not divide a strip
#else
constexpr int kLanes = 2;
constexpr int kTileStrips = 1, kTileColumns = 2;
#endif
typedef double Vector __attribute__((vector_size(kLanes * sizeof(double)), may_alias));
constexpr int kVectors = kStrip / kLanes;  // in a strip

// Pivots eliminated before what lies right of them is updated: a strip of so many columns fits in the
// first-level cache together with the tile it meets.
constexpr int kChunk = 96;
// Columns updated in one sweep over the rows: so many strips of a chunk fit in the second-level cache.
constexpr int kSweep = 192;

inline Vector broadcast(double a) { return Vector{} + a; }
inline const Vector* vectors(const double* p) { return reinterpret_cast<const Vector*>(p); }
inline Vector* vectors(double* p) { return reinterpret_cast<Vector*>(p); }

/// Sums of a tile of `kS` strips by `kC` columns.
template <int kS, int kC>
struct Tile {
  Vector sum[kS * kVectors][kC];

  /// sum ← C, whose columns are ld apart; columns from `columns` on, and all where `zero`, start at zero.
  __attribute__((always_inline)) void load(const double* C, int ld, int columns, bool zero) {
#pragma GCC unroll 16
    for (int c = 0; c < kC; ++c)
#pragma GCC unroll 16
      for (int v = 0; v < kS * kVectors; ++v)
        sum[v][c] = zero || c >= columns ? Vector{} : vectors(C + c * static_cast<long>(ld))[v];
  }

  __attribute__((always_inline)) void store(double* C, int ld, int columns) const {
#pragma GCC unroll 16
    for (int c = 0; c < kC; ++c)
      if (c < columns)
#pragma GCC unroll 16
        for (int v = 0; v < kS * kVectors; ++v) vectors(C + c * static_cast<long>(ld))[v] = sum[v][c];
  }

  /// sum ← sum − A Bᵀ over `depth` columns of strips A, `stride` apart, and rows of strip B.
  __attribute__((always_inline)) void subtract(const double* A, long stride, const double* B, int depth) {
    for (int p = 0; p < depth; ++p, A += kStrip, B += kStrip) {
      Vector a[kS * kVectors];
#pragma GCC unroll 16
      for (int v = 0; v < kS * kVectors; ++v) a[v] = vectors(A + (v / kVectors) * stride)[v % kVectors];
#pragma GCC unroll 16
      for (int c = 0; c < kC; ++c) {
        const Vector b = broadcast(B[c]);
#pragma GCC unroll 16
        for (int v = 0; v < kS * kVectors; ++v) sum[v][c] -= a[v] * b;
      }
    }
  }
};

/// C ← C − A Bᵀ for `strips` strips of A, `stride` apart, and `columns` ≤ 8 rows of strip B.
template <int kS>
inline void update_tile(const double* A, long stride, const double* B, int depth, double* C, int ld,
                        int columns, bool zero) {
#pragma GCC unroll 4
  for (int c = 0; c < kStrip; c += kTileColumns) {
    if (c >= columns) return;
    Tile<kS, kTileColumns> tile;
    tile.load(C + c * static_cast<long>(ld), ld, columns - c, zero);
    tile.subtract(A, stride, B + c, depth);
    tile.store(C + c * static_cast<long>(ld), ld, columns - c);
  }
}

void update_strips(const double* A, long stride, int strips, const double* B, int depth, double* C, int ld,
                   int columns, bool zero) {
  int s = 0;
  for (; s + kTileStrips <= strips; s += kTileStrips)
    update_tile<kTileStrips>(A + s * stride, stride, B, depth, C + s * kStrip, ld, columns, zero);
  for (; s < strips; ++s) update_tile<1>(A + s * stride, stride, B, depth, C + s * kStrip, ld, columns, zero);
}

/// Lower triangle of C ← C − A Aᵀ in whole strips, for rows and columns from the same strips on. Columns are
/// swept in groups, so that the strips they stand for stay in the cache while all rows pass by.
void update_lower(const double* A, long stride, int strips, int depth, double* C, int ld, int columns,
                  bool zero) {
  constexpr int kGroup = kSweep / kStrip;
  const int column_strips = (columns + kStrip - 1) / kStrip;
  for (int first = 0; first < column_strips; first += kGroup) {
    const int last = first + kGroup < column_strips ? first + kGroup : column_strips;
    for (int s = first; s < strips; s += kTileStrips) {
      const int rows = strips - s < kTileStrips ? strips - s : kTileStrips;
      for (int j = first; j < last && j < s + rows; ++j) {
        const int left = columns - j * kStrip;
        update_strips(A + s * stride, stride, rows, A + j * stride, depth,
                      C + j * kStrip * static_cast<long>(ld) + s * kStrip, ld, left < kStrip ? left : kStrip,
                      zero);
      }
    }
  }
}

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
  const int stay = round_up_to_strip(parent.k);
  for (int a = 0; a < count; ++a) {
    int from = map[a].from;
    for (unsigned left = map[a].mask; left; left &= left - 1, ++from) {
      const int to = map[a].to + __builtin_ctz(left);
      const double* source = U + from * static_cast<long>(ldu);
      const bool in_F = to < stay;
      double* target = in_F ? parent.F + to * static_cast<long>(parent.ld)
                            : parent.U + (to - stay) * static_cast<long>(parent.ldu);
      const int above = in_F ? 0 : stay;  // rows of the front before the target's first
      add_expanded(target + (map[a].to - above), source + from, left);
      for (int b = a + 1; b < count; ++b)
        add_expanded(target + (map[b].to - above), source + map[b].from, map[b].mask);
    }
  }
}

/// Cholesky of the triangle of a diagonal block: `columns` ≤ 8 columns of a strip of L, in place; what lies
/// above the diagonal becomes zero. The reciprocals of the pivots are given too.
///
/// Eliminates first and takes the roots afterwards, so that no pivot waits for the root of the one before.
bool factor_diagonal(double* L, int columns, double* reciprocal) {
  double pivots[kStrip];
  for (int c = 0; c < columns; ++c) {
    const double* column = L + c * kStrip;
    const double pivot = column[c];
    if (!(pivot > 0) || !(pivot < __builtin_inf())) return false;
    pivots[c] = pivot;
    const Vector factor = broadcast(1 / pivot);
    Vector scaled[kVectors];
    for (int v = 0; v < kVectors; ++v) scaled[v] = vectors(column)[v] * factor;
    for (int j = c + 1; j < columns; ++j) {
      const Vector b = broadcast(column[j]);
      for (int v = 0; v < kVectors; ++v) vectors(L + j * kStrip)[v] -= scaled[v] * b;
    }
  }
  for (int c = 0; c < columns; ++c) reciprocal[c] = 1 / __builtin_sqrt(pivots[c]);
  for (int c = 0; c < columns; ++c) {
    double* column = L + c * kStrip;
    const Vector r = broadcast(reciprocal[c]);
    for (int v = 0; v < kVectors; ++v) vectors(column)[v] *= r;
    for (int i = 0; i < c; ++i) column[i] = 0;
  }
  return true;
}

/// X ← X L⁻ᵀ for strips X of eight columns at most, with L a factored diagonal block.
template <int kS>
__attribute__((always_inline)) inline void solve_tile(Tile<kS, kStrip>& X, const double* L, int columns,
                                                      const double* reciprocal) {
#pragma GCC unroll 8
  for (int c = 0; c < kStrip; ++c) {
    if (c >= columns) break;
    const Vector r = broadcast(reciprocal[c]);
#pragma GCC unroll 16
    for (int v = 0; v < kS * kVectors; ++v) X.sum[v][c] *= r;
#pragma GCC unroll 8
    for (int j = c + 1; j < kStrip; ++j) {
      const Vector b = broadcast(L[c * kStrip + j]);
#pragma GCC unroll 16
      for (int v = 0; v < kS * kVectors; ++v) X.sum[v][j] -= X.sum[v][c] * b;
    }
  }
}

/// Strips of L below a diagonal block: F − (earlier columns of the chunk) · (rows of the block)ᵀ, then times
/// L⁻ᵀ.
template <int kS>
inline void eliminate_tile(const double* F, int ld, const double* A, long stride, const double* B, int depth,
                           const double* diagonal, int columns, const double* reciprocal, double* L) {
  Tile<kS, kStrip> tile;
  if constexpr (kTileColumns == kStrip) {
    tile.load(F, ld, columns, false);
    tile.subtract(A, stride, B, depth);
  } else {  // too few registers for all columns at once
    static_assert(kS == 1);
    alignas(64) double block[kStrip * kStrip] = {};
    for (int c = 0; c < columns; c += kTileColumns) {
      Tile<kS, kTileColumns> part;
      part.load(F + c * static_cast<long>(ld), ld, columns - c, false);
      part.subtract(A, stride, B + c, depth);
      part.store(block + c * kStrip, kStrip, kTileColumns);
    }
    tile.load(block, kStrip, kStrip, false);
  }
  solve_tile<kS>(tile, diagonal, columns, reciprocal);
#pragma GCC unroll 16
  for (int c = 0; c < kStrip; ++c)
    if (c < columns)
#pragma GCC unroll 16
      for (int v = 0; v < kS * kVectors; ++v)
        vectors(L + (v / kVectors) * stride + c * kStrip)[v % kVectors] = tile.sum[v][c];
}

/// Eliminates the pivots from `begin` to `end`, at most a chunk; columns before `begin` have been dealt with.
bool eliminate_chunk(const Front& f, int strips, int begin, int end) {
  const long stride = static_cast<long>(f.k) * kStrip;
  const double* A = f.L + begin * static_cast<long>(kStrip);
  for (int b = begin; b < end; b += kStrip) {
    const int columns = end - b < kStrip ? end - b : kStrip;
    const int top = b / kStrip, depth = b - begin;
    const double* B = A + top * stride;
    double* diagonal = f.L + top * stride + b * static_cast<long>(kStrip);
    const double* F = f.F + b * static_cast<long>(f.ld);
    double reciprocal[kStrip];

    for (int c = 0; c < columns; c += kTileColumns) {
      Tile<1, kTileColumns> tile;
      tile.load(F + c * static_cast<long>(f.ld) + b, f.ld, columns - c, false);
      tile.subtract(B, stride, B + c, depth);
      tile.store(diagonal + c * kStrip, kStrip, columns - c);
    }
    if (!factor_diagonal(diagonal, columns, reciprocal)) return false;

    int s = top + 1;
    for (; s + kTileStrips <= strips; s += kTileStrips)
      eliminate_tile<kTileStrips>(F + s * kStrip, f.ld, A + s * stride, stride, B, depth, diagonal, columns,
                                  reciprocal, f.L + s * stride + b * static_cast<long>(kStrip));
    for (; s < strips; ++s)
      eliminate_tile<1>(F + s * kStrip, f.ld, A + s * stride, stride, B, depth, diagonal, columns, reciprocal,
                        f.L + s * stride + b * static_cast<long>(kStrip));
  }
  return true;
}

bool eliminate(const Front& f) noexcept {
  const long stride = static_cast<long>(f.k) * kStrip;
  const int pivot_strips = (f.k + kStrip - 1) / kStrip, stay_strips = (f.n + kStrip - 1) / kStrip;
  const int strips = pivot_strips + stay_strips;
  for (int begin = 0; begin < f.k; begin += kChunk) {
    const int end = f.k - begin < kChunk ? f.k : begin + kChunk;
    if (!eliminate_chunk(f, strips, begin, end)) return false;
    const double* A = f.L + begin * static_cast<long>(kStrip);
    if (end < f.k) {
      const int s = end / kStrip;
      update_lower(A + s * stride, stride, strips - s, end - begin, f.F + end * static_cast<long>(f.ld) + end,
                   f.ld, f.k - end, false);
    }
    update_lower(A + pivot_strips * stride, stride, stay_strips, end - begin, f.U, f.ldu,
                 stay_strips * kStrip, begin == 0 && !f.U_is_set);
  }
  return true;
}

void back_substitute(const Front& f, const double* z, double* x) noexcept {
  const long stride = static_cast<long>(f.k) * kStrip;
  const int pivot_strips = (f.k + kStrip - 1) / kStrip, stay_strips = (f.n + kStrip - 1) / kStrip;
  const double* stay = f.L + pivot_strips * stride;
  for (int b = f.k / kStrip * kStrip; b >= 0; b -= kStrip) {
    const int columns = f.k - b < kStrip ? f.k - b : kStrip;
    if (columns == 0) continue;
    Vector sum[kStrip] = {};
    const auto gather = [&](const double* L, const double* v) {
#pragma GCC unroll 8
      for (int c = 0; c < kStrip; ++c) {
        if (c >= columns) break;
#pragma GCC unroll 4
        for (int w = 0; w < kVectors; ++w) sum[c] += vectors(L + c * kStrip)[w] * vectors(v)[w];
      }
    };
    for (int s = 0; s < stay_strips; ++s)
      gather(stay + s * stride + b * static_cast<long>(kStrip), z + s * kStrip);
    for (int s = b / kStrip + 1; s < pivot_strips; ++s)
      gather(f.L + s * stride + b * static_cast<long>(kStrip), x + s * kStrip);
    const double* diagonal = f.L + (b / kStrip) * stride + b * static_cast<long>(kStrip);
    for (int c = kStrip - 1; c >= 0; --c) {
      if (c >= columns) {
        x[b + c] = 0;
        continue;
      }
      double y = 0;
      for (int l = 0; l < kLanes; ++l) y -= sum[c][l];
      for (int i = c + 1; i < columns; ++i) y -= diagonal[c * kStrip + i] * x[b + i];
      x[b + c] = y / diagonal[c * kStrip + c];
    }
  }
}

}  // namespace

const FrontKernels TENDRIL_FRONT_KERNELS{extend_add, eliminate, back_substitute, forward_eight,
                                         backward_eight};

}  // namespace tendril::fem
