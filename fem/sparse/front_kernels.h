// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "fem/simd/simd.h"

namespace tendril::fem {

/// Rows of a panel: one AVX-512 vector, two AVX2 vectors of doubles. A panel is kSimdRows rows of a matrix,
/// packed column by column: a micro-panel of BLIS.
inline constexpr int kSimdRows = 8;

/// The least multiple of kSimdRows that is at least n.
static inline constexpr int round_up_to_panel(int n) { return (n + kSimdRows - 1) / kSimdRows * kSimdRows; }

/// A front: the dense matrix in which the pivots of a supernode are eliminated [Duff & Reid, "The
/// multifrontal solution of indefinite sparse symmetric linear equations", 1983].
///
/// Its rows are k pivots, padded to whole panels with rows of zeros, then n update rows, padded likewise. F
/// holds the columns of the pivots, one column after the other; U the lower triangle of the update rows. L is
/// where the factor's columns go, in panels of eight rows: entry (i, p) at L[(i / 8) * 8k + 8p + i % 8], so
/// that products of panels read memory in order. All three start on 64 bytes; ld and ldu are whole panels.
struct Front {
  int k;          ///< pivots
  int n;          ///< update rows
  double* F;      ///< ld × k, column-major; destroyed
  int ld;         ///< round_up(k) + round_up(n), or more
  double* L;      ///< (round_up(k) + round_up(n)) × k, in panels
  double* U;      ///< round_up(n) columns of length ldu
  int ldu;        ///< round_up(n), or more
  bool U_is_set;  ///< false: U is taken to be zero
};

/// Which rows of a parent's front some rows of a child's update matrix are: bit b of `mask` stands for the
/// parent's row to + b, and the child's rows for the bits that are set are consecutive from row `from` on.
struct RowMap {
  int from;       ///< row of the child's update matrix
  int to;         ///< row of the parent's front, the first of a panel
  unsigned mask;  ///< eight bits, not all zero
};

/// The dense kernels of the factorisation. Real-time: no, all of them (time depends on the front; they
/// allocate nothing).
struct FrontKernels {
  /// Adds the lower triangle of a child's update matrix to its parent's F and U.
  /// @param U    the child's, with columns of length ldu
  /// @param map  `count` maps, rows ascending in both
  void (*extend_add)(const double* U, int ldu, const RowMap* map, int count, const Front& parent) noexcept;

  /// Eliminates the pivots: F = L Lᵀ in its first k rows, L = F L⁻ᵀ below, and U ← U − L Lᵀ, the Schur
  /// complement (lower triangle; parts of the upper one are overwritten too).
  /// @return  false where a pivot is not positive or not finite
  bool (*eliminate)(const Front& front) noexcept;

  /// Solves L₁ᵀ x = −L₂ᵀ z, with L₁ the first k rows of L and L₂ the others.
  /// @param z  round_up(n) numbers
  /// @param x  k numbers; room for round_up(k)
  void (*back_substitute)(const Front& front, const double* z, double* x) noexcept;

  // Those below take eight right-hand sides and L in single precision, laid out as in Front. A row of z has
  // eight numbers, one for each right-hand side: round_up(k) rows of the pivots, with zeros as padding, then
  // round_up(n) update rows. L and z start on 64 bytes.

  /// z₁ ← y with L₁ y = z₁, and z₂ ← −L₂ y.
  void (*forward_substitute_eight)(const float* L, int k, int n, float* z) noexcept;

  /// z₁ ← x with L₁ᵀ x = z₁ − L₂ᵀ z₂.
  void (*backward_substitute_eight)(const float* L, int k, int n, float* z) noexcept;
};

/// Those of an instruction set; kV3 stands in for kScalar.
const FrontKernels& front_kernels(InstructionSet set = best_instruction_set());

}  // namespace tendril::fem
