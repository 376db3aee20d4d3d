// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tendril::qp {

inline constexpr int kSimdRows = 4;  ///< numbers in one SIMD vector

/// Four numbers that one instruction handles; one register on a processor with AVX.
using Simd = double __attribute__((vector_size(8 * kSimdRows)));

// The same in memory, at any address of a double. No alias: clang would not take the alignment.
typedef double UnalignedSimd __attribute__((vector_size(8 * kSimdRows), aligned(8), may_alias));

/// For each of the four numbers: all bits set, or none.
using SimdMask = long long __attribute__((vector_size(8 * kSimdRows)));

constexpr int round_up_to_simd(int n) { return (n + kSimdRows - 1) / kSimdRows * kSimdRows; }

inline Simd load(const double* p) { return *reinterpret_cast<const UnalignedSimd*>(p); }
inline void store(double* p, Simd v) { *reinterpret_cast<UnalignedSimd*>(p) = v; }

/// The first `count` numbers at p, where there may be fewer than four; the others are zero.
inline Simd load_partial(const double* p, int count) {
  if (__builtin_expect(count >= kSimdRows, 1)) return load(p);
  return Simd{count > 0 ? p[0] : 0, count > 1 ? p[1] : 0, count > 2 ? p[2] : 0, 0};
}

inline Simd broadcast(double a) { return Simd{a, a, a, a}; }
inline Simd min(Simd a, Simd b) { return a < b ? a : b; }
inline Simd max(Simd a, Simd b) { return a > b ? a : b; }
inline Simd abs(Simd a) { return max(a, -a); }

inline bool reduce_and(SimdMask m) { return (m[0] & m[1] & m[2] & m[3]) != 0; }
inline double reduce_sum(Simd v) { return (v[0] + v[2]) + (v[1] + v[3]); }
inline double reduce_max(Simd v) {
  const double a = v[0] > v[2] ? v[0] : v[2], b = v[1] > v[3] ? v[1] : v[3];
  return a > b ? a : b;
}

}  // namespace tendril::qp
