// Vectors of TENDRIL_WIDTH doubles, one for each of as many tetrahedra, and their way from and to memory. For
// the kernel bodies alone, see simd.h.
#pragma once

namespace tendril::fem {
namespace {

constexpr int kWidth = TENDRIL_WIDTH;
using Lanes = double __attribute__((vector_size(8 * TENDRIL_WIDTH)));
using Mask = long long __attribute__((vector_size(8 * TENDRIL_WIDTH)));
using Four = double __attribute__((vector_size(32)));
// The same in memory, wherever doubles may lie. No aliases: clang would not take the alignment.
typedef double LooseLanes __attribute__((vector_size(8 * TENDRIL_WIDTH), aligned(8), may_alias));
typedef double LooseFour __attribute__((vector_size(32), aligned(8), may_alias));

inline Lanes load(const double* p) { return *reinterpret_cast<const LooseLanes*>(p); }
inline void store(double* p, Lanes v) { *reinterpret_cast<LooseLanes*>(p) = v; }
inline Four load_four(const double* p) { return *reinterpret_cast<const LooseFour*>(p); }
inline void add_four(double* p, Four v) { *reinterpret_cast<LooseFour*>(p) += v; }

/// One bit a lane.
inline unsigned bits(Mask m) {
  unsigned result = 0;
  for (int i = 0; i < kWidth; ++i) result |= (m[i] != 0 ? 1u : 0u) << i;
  return result;
}

/// A vector of space in every lane.
struct Vector {
  Lanes x, y, z;
};

inline Vector operator+(const Vector& a, const Vector& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vector operator-(const Vector& a) { return {-a.x, -a.y, -a.z}; }
inline Vector operator*(Lanes s, const Vector& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Lanes dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vector cross(const Vector& a, const Vector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A 3 × 3 matrix in every lane, by columns.
struct Matrix {
  Vector x, y, z;
};

inline Matrix operator+(const Matrix& A, const Matrix& B) { return {A.x + B.x, A.y + B.y, A.z + B.z}; }
inline Matrix operator-(const Matrix& A) { return {-A.x, -A.y, -A.z}; }
inline Vector operator*(const Matrix& A, const Vector& v) { return v.x * A.x + v.y * A.y + v.z * A.z; }
inline Matrix operator*(const Matrix& A, const Matrix& B) { return {A * B.x, A * B.y, A * B.z}; }
inline Matrix transpose(const Matrix& A) {
  return {{A.x.x, A.y.x, A.z.x}, {A.x.y, A.y.y, A.z.y}, {A.x.z, A.y.z, A.z.z}};
}
/// a bᵀ
inline Matrix outer(const Vector& a, const Vector& b) { return {b.x * a, b.y * a, b.z * a}; }
/// A + s I
inline Matrix add_to_diagonal(Matrix A, Lanes s) {
  A.x.x += s, A.y.y += s, A.z.z += s;
  return A;
}

#if TENDRIL_WIDTH == 8

inline bool all(Mask m) {
  m &= __builtin_shufflevector(m, m, 4, 5, 6, 7, 0, 1, 2, 3);
  m &= __builtin_shufflevector(m, m, 2, 3, 0, 1, 6, 7, 4, 5);
  return (m[0] & m[1]) != 0;
}

inline Lanes join(Four a, Four b) { return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7); }
inline Lanes join_low(Lanes a, Lanes b) { return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11); }
inline Lanes join_high(Lanes a, Lanes b) { return __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15); }
inline Four low(Lanes a) { return __builtin_shufflevector(a, a, 0, 1, 2, 3); }
inline Four high(Lanes a) { return __builtin_shufflevector(a, a, 4, 5, 6, 7); }

/// Transposes both halves of four vectors as 4 × 4 matrices.
inline void transpose_halves(Lanes& a, Lanes& b, Lanes& c, Lanes& d) {
  const Lanes ab0 = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14);
  const Lanes ab1 = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
  const Lanes cd0 = __builtin_shufflevector(c, d, 0, 8, 2, 10, 4, 12, 6, 14);
  const Lanes cd1 = __builtin_shufflevector(c, d, 1, 9, 3, 11, 5, 13, 7, 15);
  a = __builtin_shufflevector(ab0, cd0, 0, 1, 8, 9, 4, 5, 12, 13);
  b = __builtin_shufflevector(ab1, cd1, 0, 1, 8, 9, 4, 5, 12, 13);
  c = __builtin_shufflevector(ab0, cd0, 2, 3, 10, 11, 6, 7, 14, 15);
  d = __builtin_shufflevector(ab1, cd1, 2, 3, 10, 11, 6, 7, 14, 15);
}

/// Vectors of the given nodes, of which there are four numbers each at p.
inline Vector gather(const double* p, const int* node) {
  Lanes a = join(load_four(p + 4 * node[0]), load_four(p + 4 * node[4]));
  Lanes b = join(load_four(p + 4 * node[1]), load_four(p + 4 * node[5]));
  Lanes c = join(load_four(p + 4 * node[2]), load_four(p + 4 * node[6]));
  Lanes d = join(load_four(p + 4 * node[3]), load_four(p + 4 * node[7]));
  transpose_halves(a, b, c, d);
  return {a, b, c};
}

inline void scatter_add(const Vector& v, double* p, const int* node) {
  Lanes a = v.x, b = v.y, c = v.z, d = {};
  transpose_halves(a, b, c, d);
  add_four(p + 4 * node[0], low(a)), add_four(p + 4 * node[4], high(a));
  add_four(p + 4 * node[1], low(b)), add_four(p + 4 * node[5], high(b));
  add_four(p + 4 * node[2], low(c)), add_four(p + 4 * node[6], high(c));
  add_four(p + 4 * node[3], low(d)), add_four(p + 4 * node[7], high(d));
}

inline void add_to_block(double* block, Lanes first_eight, double last) {
  store(block, load(block) + first_eight);
  block[8] += last;
}

/// Adds the matrix of every lane to nine numbers from `numbers + place` on.
inline void scatter_add(const Matrix& A, double* numbers, const int* place) {
  double last[kWidth];
  store(last, A.z.z);
  Lanes a = A.x.x, b = A.x.y, c = A.x.z, d = A.y.x, e = A.y.y, f = A.y.z, g = A.z.x, h = A.z.y;
  transpose_halves(a, b, c, d);
  transpose_halves(e, f, g, h);
  add_to_block(numbers + place[0], join_low(a, e), last[0]);
  add_to_block(numbers + place[1], join_low(b, f), last[1]);
  add_to_block(numbers + place[2], join_low(c, g), last[2]);
  add_to_block(numbers + place[3], join_low(d, h), last[3]);
  add_to_block(numbers + place[4], join_high(a, e), last[4]);
  add_to_block(numbers + place[5], join_high(b, f), last[5]);
  add_to_block(numbers + place[6], join_high(c, g), last[6]);
  add_to_block(numbers + place[7], join_high(d, h), last[7]);
}

#else

inline bool all(Mask m) {
  m &= __builtin_shufflevector(m, m, 2, 3, 0, 1);
  return (m[0] & m[1]) != 0;
}

inline void transpose(Four& a, Four& b, Four& c, Four& d) {
  const Four ab0 = __builtin_shufflevector(a, b, 0, 4, 2, 6), ab1 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Four cd0 = __builtin_shufflevector(c, d, 0, 4, 2, 6), cd1 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  a = __builtin_shufflevector(ab0, cd0, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab1, cd1, 0, 1, 4, 5);
  c = __builtin_shufflevector(ab0, cd0, 2, 3, 6, 7);
  d = __builtin_shufflevector(ab1, cd1, 2, 3, 6, 7);
}

/// Vectors of the given nodes, of which there are four numbers each at p.
inline Vector gather(const double* p, const int* node) {
  Four a = load_four(p + 4 * node[0]), b = load_four(p + 4 * node[1]), c = load_four(p + 4 * node[2]),
       d = load_four(p + 4 * node[3]);
  transpose(a, b, c, d);
  return {a, b, c};
}

inline void scatter_add(const Vector& v, double* p, const int* node) {
  Four a = v.x, b = v.y, c = v.z, d = {};
  transpose(a, b, c, d);
  add_four(p + 4 * node[0], a), add_four(p + 4 * node[1], b);
  add_four(p + 4 * node[2], c), add_four(p + 4 * node[3], d);
}

inline void add_to_block(double* block, Four first, Four second, double last) {
  add_four(block, first), add_four(block + 4, second);
  block[8] += last;
}

/// Adds the matrix of every lane to nine numbers from `numbers + place` on.
inline void scatter_add(const Matrix& A, double* numbers, const int* place) {
  double last[kWidth];
  store(last, A.z.z);
  Four a = A.x.x, b = A.x.y, c = A.x.z, d = A.y.x, e = A.y.y, f = A.y.z, g = A.z.x, h = A.z.y;
  transpose(a, b, c, d);
  transpose(e, f, g, h);
  add_to_block(numbers + place[0], a, e, last[0]);
  add_to_block(numbers + place[1], b, f, last[1]);
  add_to_block(numbers + place[2], c, g, last[2]);
  add_to_block(numbers + place[3], d, h, last[3]);
}

#endif

}  // namespace
}  // namespace tendril::fem
