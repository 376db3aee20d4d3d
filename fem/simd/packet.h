// SPDX-License-Identifier: Apache-2.0
// Vectors of TENDRIL_PACKET_SIZE doubles, one double for each of as many tetrahedra, and their loads and
// stores. For kernel sources alone, see simd.h.
#pragma once

namespace tendril::fem {
namespace {

constexpr int kPacketSize = TENDRIL_PACKET_SIZE;
using Packet = double __attribute__((vector_size(8 * TENDRIL_PACKET_SIZE)));
using PacketMask = long long __attribute__((vector_size(8 * TENDRIL_PACKET_SIZE)));
using Packet4d = double __attribute__((vector_size(32)));
// The same in memory without alignment. No alias declarations: clang would drop the alignment.
typedef double UnalignedPacket __attribute__((vector_size(8 * TENDRIL_PACKET_SIZE), aligned(8), may_alias));
typedef double UnalignedPacket4d __attribute__((vector_size(32), aligned(8), may_alias));

inline Packet load(const double* p) { return *reinterpret_cast<const UnalignedPacket*>(p); }
inline void store(double* p, Packet v) { *reinterpret_cast<UnalignedPacket*>(p) = v; }
inline Packet4d load4d(const double* p) { return *reinterpret_cast<const UnalignedPacket4d*>(p); }
inline void add4d(double* p, Packet4d v) { *reinterpret_cast<UnalignedPacket4d*>(p) += v; }

/// Bit i is 1 if lane i is true.
inline unsigned bits(PacketMask m) {
  unsigned result = 0;
  for (int i = 0; i < kPacketSize; ++i) result |= (m[i] != 0 ? 1u : 0u) << i;
  return result;
}

/// A vector of three components in each lane.
struct Vector3 {
  Packet x, y, z;
};

inline Vector3 operator+(const Vector3& a, const Vector3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vector3 operator-(const Vector3& a, const Vector3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vector3 operator-(const Vector3& a) { return {-a.x, -a.y, -a.z}; }
inline Vector3 operator*(Packet s, const Vector3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Packet dot(const Vector3& a, const Vector3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A 3 × 3 matrix in each lane, by columns.
struct Matrix3 {
  Vector3 x, y, z;
};

inline Matrix3 operator+(const Matrix3& A, const Matrix3& B) { return {A.x + B.x, A.y + B.y, A.z + B.z}; }
inline Matrix3 operator-(const Matrix3& A) { return {-A.x, -A.y, -A.z}; }
inline Vector3 operator*(const Matrix3& A, const Vector3& v) { return v.x * A.x + v.y * A.y + v.z * A.z; }
inline Matrix3 operator*(const Matrix3& A, const Matrix3& B) { return {A * B.x, A * B.y, A * B.z}; }
inline Matrix3 transpose(const Matrix3& A) {
  return {{A.x.x, A.y.x, A.z.x}, {A.x.y, A.y.y, A.z.y}, {A.x.z, A.y.z, A.z.z}};
}
/// a bᵀ
inline Matrix3 outer(const Vector3& a, const Vector3& b) { return {b.x * a, b.y * a, b.z * a}; }
/// A + s I
inline Matrix3 add_to_diagonal(Matrix3 A, Packet s) {
  A.x.x += s, A.y.y += s, A.z.z += s;
  return A;
}

#if TENDRIL_PACKET_SIZE == 8

inline bool all(PacketMask m) {
  m &= __builtin_shufflevector(m, m, 4, 5, 6, 7, 0, 1, 2, 3);
  m &= __builtin_shufflevector(m, m, 2, 3, 0, 1, 6, 7, 4, 5);
  return (m[0] & m[1]) != 0;
}

inline Packet join(Packet4d a, Packet4d b) { return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7); }
inline Packet join_low(Packet a, Packet b) { return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11); }
inline Packet join_high(Packet a, Packet b) {
  return __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
}
inline Packet4d low(Packet a) { return __builtin_shufflevector(a, a, 0, 1, 2, 3); }
inline Packet4d high(Packet a) { return __builtin_shufflevector(a, a, 4, 5, 6, 7); }

/// Transposes both halves of four vectors as 4 × 4 matrices.
inline void transpose_halves(Packet& a, Packet& b, Packet& c, Packet& d) {
  const Packet ab0 = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14);
  const Packet ab1 = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
  const Packet cd0 = __builtin_shufflevector(c, d, 0, 8, 2, 10, 4, 12, 6, 14);
  const Packet cd1 = __builtin_shufflevector(c, d, 1, 9, 3, 11, 5, 13, 7, 15);
  a = __builtin_shufflevector(ab0, cd0, 0, 1, 8, 9, 4, 5, 12, 13);
  b = __builtin_shufflevector(ab1, cd1, 0, 1, 8, 9, 4, 5, 12, 13);
  c = __builtin_shufflevector(ab0, cd0, 2, 3, 10, 11, 6, 7, 14, 15);
  d = __builtin_shufflevector(ab1, cd1, 2, 3, 10, 11, 6, 7, 14, 15);
}

/// The vectors of the given nodes. Each node has four numbers at p, the last one unused.
inline Vector3 gather(const double* p, const int* node) {
  Packet a = join(load4d(p + 4 * node[0]), load4d(p + 4 * node[4]));
  Packet b = join(load4d(p + 4 * node[1]), load4d(p + 4 * node[5]));
  Packet c = join(load4d(p + 4 * node[2]), load4d(p + 4 * node[6]));
  Packet d = join(load4d(p + 4 * node[3]), load4d(p + 4 * node[7]));
  transpose_halves(a, b, c, d);
  return {a, b, c};
}

inline void scatter_add(const Vector3& v, double* p, const int* node) {
  Packet a = v.x, b = v.y, c = v.z, d = {};
  transpose_halves(a, b, c, d);
  add4d(p + 4 * node[0], low(a)), add4d(p + 4 * node[4], high(a));
  add4d(p + 4 * node[1], low(b)), add4d(p + 4 * node[5], high(b));
  add4d(p + 4 * node[2], low(c)), add4d(p + 4 * node[6], high(c));
  add4d(p + 4 * node[3], low(d)), add4d(p + 4 * node[7], high(d));
}

inline void add_to_block(double* block, Packet first_eight, double last) {
  store(block, load(block) + first_eight);
  block[8] += last;
}

/// Adds the matrix of lane i to the nine numbers from numbers + offset[i] on.
inline void scatter_add(const Matrix3& A, double* numbers, const int* offset) {
  double last[kPacketSize];
  store(last, A.z.z);
  Packet a = A.x.x, b = A.x.y, c = A.x.z, d = A.y.x, e = A.y.y, f = A.y.z, g = A.z.x, h = A.z.y;
  transpose_halves(a, b, c, d);
  transpose_halves(e, f, g, h);
  add_to_block(numbers + offset[0], join_low(a, e), last[0]);
  add_to_block(numbers + offset[1], join_low(b, f), last[1]);
  add_to_block(numbers + offset[2], join_low(c, g), last[2]);
  add_to_block(numbers + offset[3], join_low(d, h), last[3]);
  add_to_block(numbers + offset[4], join_high(a, e), last[4]);
  add_to_block(numbers + offset[5], join_high(b, f), last[5]);
  add_to_block(numbers + offset[6], join_high(c, g), last[6]);
  add_to_block(numbers + offset[7], join_high(d, h), last[7]);
}

#else

inline bool all(PacketMask m) {
  m &= __builtin_shufflevector(m, m, 2, 3, 0, 1);
  return (m[0] & m[1]) != 0;
}

inline void transpose(Packet4d& a, Packet4d& b, Packet4d& c, Packet4d& d) {
  const Packet4d ab0 = __builtin_shufflevector(a, b, 0, 4, 2, 6),
                 ab1 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Packet4d cd0 = __builtin_shufflevector(c, d, 0, 4, 2, 6),
                 cd1 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  a = __builtin_shufflevector(ab0, cd0, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab1, cd1, 0, 1, 4, 5);
  c = __builtin_shufflevector(ab0, cd0, 2, 3, 6, 7);
  d = __builtin_shufflevector(ab1, cd1, 2, 3, 6, 7);
}

/// The vectors of the given nodes. Each node has four numbers at p, the last one unused.
inline Vector3 gather(const double* p, const int* node) {
  Packet4d a = load4d(p + 4 * node[0]), b = load4d(p + 4 * node[1]), c = load4d(p + 4 * node[2]),
           d = load4d(p + 4 * node[3]);
  transpose(a, b, c, d);
  return {a, b, c};
}

inline void scatter_add(const Vector3& v, double* p, const int* node) {
  Packet4d a = v.x, b = v.y, c = v.z, d = {};
  transpose(a, b, c, d);
  add4d(p + 4 * node[0], a), add4d(p + 4 * node[1], b);
  add4d(p + 4 * node[2], c), add4d(p + 4 * node[3], d);
}

inline void add_to_block(double* block, Packet4d first, Packet4d second, double last) {
  add4d(block, first), add4d(block + 4, second);
  block[8] += last;
}

/// Adds the matrix of lane i to the nine numbers from numbers + offset[i] on.
inline void scatter_add(const Matrix3& A, double* numbers, const int* offset) {
  double last[kPacketSize];
  store(last, A.z.z);
  Packet4d a = A.x.x, b = A.x.y, c = A.x.z, d = A.y.x, e = A.y.y, f = A.y.z, g = A.z.x, h = A.z.y;
  transpose(a, b, c, d);
  transpose(e, f, g, h);
  add_to_block(numbers + offset[0], a, e, last[0]);
  add_to_block(numbers + offset[1], b, f, last[1]);
  add_to_block(numbers + offset[2], c, g, last[2]);
  add_to_block(numbers + offset[3], d, h, last[3]);
}

#endif

}  // namespace
}  // namespace tendril::fem
