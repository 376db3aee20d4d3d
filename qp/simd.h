#pragma once

namespace tendril::qp {

inline constexpr int kStrip = 4;  ///< numbers in a strip

/// Four numbers that are worked on at once; one register on a processor with AVX.
using Strip = double __attribute__((vector_size(8 * kStrip)));

// The same in memory, wherever doubles may lie. No alias: clang would not take the alignment.
typedef double LooseStrip __attribute__((vector_size(8 * kStrip), aligned(8), may_alias));

/// All bits of a lane set, or none.
using Mask = long long __attribute__((vector_size(8 * kStrip)));

constexpr int round_up_to_strip(int n) { return (n + kStrip - 1) / kStrip * kStrip; }

inline Strip load(const double* p) { return *reinterpret_cast<const LooseStrip*>(p); }
inline void store(double* p, Strip s) { *reinterpret_cast<LooseStrip*>(p) = s; }

[[gnu::noinline]] inline Strip load_fewer(const double* p, int count) {
  Strip s = {};
  for (int i = 0; i < count; ++i) s[i] = p[i];
  return s;
}
/// The first `count` numbers at p, where there may be fewer than four; the others are zero.
inline Strip load_some(const double* p, int count) {
  return __builtin_expect(count >= kStrip, 1) ? load(p) : load_fewer(p, count);
}

inline Strip broadcast(double a) { return Strip{a, a, a, a}; }
inline Strip min(Strip a, Strip b) { return a < b ? a : b; }
inline Strip max(Strip a, Strip b) { return a > b ? a : b; }
inline Strip abs(Strip a) { return max(a, -a); }
/// By how much each value is beyond its bounds, signed.
inline Strip beyond(Strip value, Strip lower, Strip upper) {
  return min(value - lower, Strip{}) + max(value - upper, Strip{});
}

inline bool all(Mask m) { return (m[0] & m[1] & m[2] & m[3]) != 0; }
inline double sum(Strip s) { return (s[0] + s[2]) + (s[1] + s[3]); }
inline double largest(Strip s) {
  const double a = s[0] > s[2] ? s[0] : s[2], b = s[1] > s[3] ? s[1] : s[3];
  return a > b ? a : b;
}

}  // namespace tendril::qp
