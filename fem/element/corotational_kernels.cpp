// SPDX-License-Identifier: Apache-2.0
// The formulas of CorotationalElement for a batch of elements. Compiled once for each instruction set: see
// simd.h for what may stand here.
#include "fem/element/batch_operations.h"

namespace tendril::fem::TENDRIL_INSTRUCTION_SET {
namespace {

// A warm start needs two or three iterations.
constexpr int kRotationIterations = 10;
// The iteration converges quadratically: after a step of ω with ω² below this the error is that of rounding.
constexpr double kRotationStep2 = 1e-17;

/// A rotation. Its length may be any but zero.
struct Quaternion {
  Packet w;
  Vector3 v;
};

inline Packet norm2(const Quaternion& q) { return q.w * q.w + dot(q.v, q.v); }

inline Matrix3 rotation(const Quaternion& q) {
  const Vector3 u = (2 / norm2(q)) * q.v;
  const Packet xx = u.x * q.v.x, yy = u.y * q.v.y, zz = u.z * q.v.z;
  const Packet xy = u.x * q.v.y, xz = u.x * q.v.z, yz = u.y * q.v.z;
  const Vector3 w = q.w * u;
  return {{1 - yy - zz, xy + w.z, xz - w.y},
          {xy - w.z, 1 - xx - zz, yz + w.x},
          {xz + w.y, yz - w.x, 1 - xx - yy}};
}

/// The quaternion after a rotation of about ω (rad) in its own frame.
inline Quaternion rotated(const Quaternion& q, const Vector3& omega) {
  const Vector3 half = 0.5 * (Packet{} + 1) * omega;
  return {q.w - dot(q.v, half), q.w * half + q.v + cross(q.v, half)};
}

inline Quaternion load_quaternion(const ElementBatch& batch, int first) {
  return {load(&batch.q[0][first]),
          {load(&batch.q[1][first]), load(&batch.q[2][first]), load(&batch.q[3][first])}};
}

/// Keeps the length of a quaternion near one: |q| ← 2|q| / (1 + |q|²) converges to it quadratically.
inline void store_quaternion(ElementBatch& batch, int first, const Quaternion& q) {
  const Packet s = 2 / (1 + norm2(q));
  store(&batch.q[0][first], s * q.w);
  store(&batch.q[1][first], s * q.v.x);
  store(&batch.q[2][first], s * q.v.y);
  store(&batch.q[3][first], s * q.v.z);
}

/// Of a symmetric matrix: adjugate and determinant, with the minor that together with them shows whether it
/// is positive definite.
struct Inversion {
  Packet xx, yy, zz, yz, xz, xy;
  Packet det, minor;
};

/// Of T = tr(S) I − S, S the symmetric part of M = RᵀF.
inline Inversion invert_rotation_hessian(const Matrix3& M) {
  const Packet xx = M.y.y + M.z.z, yy = M.x.x + M.z.z, zz = M.x.x + M.y.y;
  const Packet xy = -0.5 * (M.x.y + M.y.x), xz = -0.5 * (M.x.z + M.z.x), yz = -0.5 * (M.y.z + M.z.y);
  Inversion a;
  a.minor = xx;
  a.xx = yy * zz - yz * yz, a.yy = xx * zz - xz * xz, a.zz = xx * yy - xy * xy;
  a.xy = xz * yz - xy * zz, a.xz = xy * yz - xz * yy, a.yz = xy * xz - yz * xx;
  a.det = xx * a.xx + xy * a.xy + xz * a.xz;
  return a;
}

inline Matrix3 symmetric(const Inversion& a, Packet scale) {
  const Packet xy = scale * a.xy, xz = scale * a.xz, yz = scale * a.yz;
  return {{scale * a.xx, xy, xz}, {xy, scale * a.yy, yz}, {xz, yz, scale * a.zz}};
}

unsigned update_rotations(ElementBatch& batch, const double* positions) {
  unsigned failed = 0;
  for (int first = 0; first < kBatchSize; first += kPacketSize) {
    const Matrix3 F = deformation_gradient(batch, first, edges(batch, first, positions));
    Quaternion q = load_quaternion(batch, first);
    PacketMask done = {};
    for (int k = 0; k < kRotationIterations && !all(done); ++k) {
      const Matrix3 M = transpose(rotation(q)) * F;
      const Inversion T = invert_rotation_hessian(M);
      const Vector3 axial{M.y.z - M.z.y, M.z.x - M.x.z, M.x.y - M.y.x};
      const Vector3 omega = symmetric(T, 1 / T.det) * axial;
      q = rotated(q, omega);
      done = (dot(omega, omega) < kRotationStep2) & (T.det > 0) & (T.zz > 0) & (T.minor > 0);
      store(&batch.theta[first], M.x.x + M.y.y + M.z.z - 3);
    }
    store_quaternion(batch, first, q);
    done &= dot(F.x, cross(F.y, F.z)) > 0;
    if (!all(done)) failed |= bits(~done) << first;
  }
  return failed;
}

/// A [v]×
inline Matrix3 times_cross(const Matrix3& A, const Vector3& v) {
  return {v.z * A.y - v.y * A.z, v.x * A.z - v.z * A.x, v.y * A.x - v.x * A.y};
}

/// [v]×ᵀ A
inline Matrix3 cross_times(const Vector3& v, const Matrix3& A) {
  return {cross(A.x, v), cross(A.y, v), cross(A.z, v)};
}

void add(const ElementBatch& batch, bool exact, const double* positions, double* forces, double* blocks,
         VolumeGradient* volume_gradient) {
  for (int first = 0; first < kBatchSize; first += kPacketSize) {
    const Packet V = load(&batch.volume[first]);
    const Packet mu = load(&batch.mu[first]) * V, lambda = load(&batch.lambda[first]) * V;
    const Vector3 g[3] = {gradient(batch, 0, first), gradient(batch, 1, first), gradient(batch, 2, first)};
    const Matrix3 F = deformation_gradient(batch, first, edges(batch, first, positions));
    const Matrix3 R = rotation(load_quaternion(batch, first));
    const Matrix3 M = transpose(R) * F;
    const Vector3 h[3] = {R * g[0], R * g[1], R * g[2]};
    const Packet c = lambda * (M.x.x + M.y.y + M.z.z - 3) + load(&batch.pressure[first]) * V - 2 * mu;
    if (volume_gradient) store_volume_gradient(h, V, first, *volume_gradient);

    NodalShares s;
    for (int b = 0; b < 3; ++b) s.force[b] = -(2 * mu * (F * g[b]) + c * h[b]);
    if (exact) {
      const Inversion T = invert_rotation_hessian(M);
      const Matrix3 B = R * (symmetric(T, c / T.det) * transpose(R));
      const Matrix3 B1 = times_cross(B, h[0]), B2 = times_cross(B, h[1]), B3 = times_cross(B, h[2]);
      const auto block = [&](int a, int b, const Matrix3& B_b) {
        return add_to_diagonal(cross_times(h[a], B_b) + outer(lambda * h[a], h[b]), 2 * mu * dot(g[a], g[b]));
      };
      s.K11 = block(0, 0, B1), s.K21 = block(1, 0, B1), s.K22 = block(1, 1, B2);
      s.K31 = block(2, 0, B1), s.K32 = block(2, 1, B2), s.K33 = block(2, 2, B3);
    } else {
      const auto block = [&](int a, int b) {
        return add_to_diagonal(outer(mu * h[b], h[a]) + outer(lambda * h[a], h[b]), mu * dot(g[a], g[b]));
      };
      s.K11 = block(0, 0), s.K21 = block(1, 0), s.K22 = block(1, 1);
      s.K31 = block(2, 0), s.K32 = block(2, 1), s.K33 = block(2, 2);
    }
    scatter_add(s, batch, first, forces, blocks);
  }
}

}  // namespace

extern const ElementKernels kCorotationalKernels{update_rotations, add, true};

}  // namespace tendril::fem::TENDRIL_INSTRUCTION_SET
