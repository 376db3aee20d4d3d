// The passes of element_kernels.h, compiled once for each instruction set: see simd.h for what may stand
// here. The formulas are those of CorotationalElement and NeoHookeanElement.
#include "fem/element/element_kernels.h"
#include "fem/simd/packet.h"

namespace tendril::fem {
namespace {

// A warm start needs two or three iterations.
constexpr int kRotationIterations = 10;
// The iteration converges quadratically: after a step of ω with ω² below this the error is that of rounding.
constexpr double kRotationStep2 = 1e-17;

/// The edges from corner 0 to the others.
struct Edges {
  Vector3 e[3];
};

inline Edges edges(const ElementBatch& batch, int first, const double* positions) {
  const Vector3 origin = gather(positions, &batch.node[0][first]);
  Edges result;
  for (int b = 0; b < 3; ++b) result.e[b] = gather(positions, &batch.node[b + 1][first]) - origin;
  return result;
}

/// ∇N of corner b + 1.
inline Vector3 gradient(const ElementBatch& batch, int b, int first) {
  return {load(&batch.g[b][0][first]), load(&batch.g[b][1][first]), load(&batch.g[b][2][first])};
}

inline Matrix3 deformation_gradient(const ElementBatch& batch, int first, const Edges& edges) {
  const Vector3 g1 = gradient(batch, 0, first), g2 = gradient(batch, 1, first),
                g3 = gradient(batch, 2, first);
  return outer(edges.e[0], g1) + outer(edges.e[1], g2) + outer(edges.e[2], g3);
}

/// A rotation, of any length but zero.
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

/// The quaternion followed by a turn of about ω in its own frame.
inline Quaternion turned(const Quaternion& q, const Vector3& omega) {
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

/// A symmetric matrix's adjugate and determinant, with the minor that tells with them whether it is positive.
struct Inversion {
  Packet xx, yy, zz, yz, xz, xy;
  Packet det, minor;
};

/// Of T = tr(S) I − S, S the symmetric part of M = RᵀF.
inline Inversion invert_turning(const Matrix3& M) {
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

unsigned rotate(ElementBatch& batch, const double* positions) {
  unsigned doubtful = 0;
  for (int first = 0; first < kBatchSize; first += kPacketSize) {
    const Matrix3 F = deformation_gradient(batch, first, edges(batch, first, positions));
    Quaternion q = load_quaternion(batch, first);
    PacketMask done = {};
    for (int k = 0; k < kRotationIterations && !all(done); ++k) {
      const Matrix3 M = transpose(rotation(q)) * F;
      const Inversion T = invert_turning(M);
      const Vector3 axial{M.y.z - M.z.y, M.z.x - M.x.z, M.x.y - M.y.x};
      const Vector3 omega = symmetric(T, 1 / T.det) * axial;
      q = turned(q, omega);
      done = (dot(omega, omega) < kRotationStep2) & (T.det > 0) & (T.zz > 0) & (T.minor > 0);
      store(&batch.theta[first], M.x.x + M.y.y + M.z.z - 3);
    }
    store_quaternion(batch, first, q);
    done &= dot(F.x, cross(F.y, F.z)) > 0;
    if (!all(done)) doubtful |= bits(~done) << first;
  }
  return doubtful;
}

unsigned dilate(ElementBatch& batch, const double* positions) {
  unsigned inverted = 0;
  for (int first = 0; first < kBatchSize; first += kPacketSize) {
    const Matrix3 F = deformation_gradient(batch, first, edges(batch, first, positions));
    const Packet J = dot(F.x, cross(F.y, F.z));
    store(&batch.theta[first], J - 1);
    inverted |= bits(~(J > 0)) << first;
  }
  return inverted;
}

/// What is known of corners 1 to 3; that of corner 0 makes the sum over the corners zero.
struct Shares {
  Vector3 force[3];
  Matrix3 K11, K21, K22, K31, K32, K33;
};

void scatter_add(const Shares& s, const ElementBatch& batch, int first, double* forces, double* blocks) {
  scatter_add(-(s.force[0] + s.force[1] + s.force[2]), forces, &batch.node[0][first]);
  for (int b = 0; b < 3; ++b) scatter_add(s.force[b], forces, &batch.node[b + 1][first]);

  const Matrix3 K10 = -(s.K11 + transpose(s.K21) + transpose(s.K31));
  const Matrix3 K20 = -(s.K21 + s.K22 + transpose(s.K32));
  const Matrix3 K30 = -(s.K31 + s.K32 + s.K33);
  const Matrix3* by_position[10] = {nullptr, &K10, &s.K11, &K20,   &s.K21,
                                    &s.K22,  &K30, &s.K31, &s.K32, &s.K33};
  scatter_add(-(K10 + K20 + K30), blocks, &batch.block_offset[0][first]);
  for (int k = 1; k < 10; ++k) scatter_add(*by_position[k], blocks, &batch.block_offset[k][first]);
}

void store_volume_gradient(const Vector3 (&by_corner)[3], Packet volume, int first,
                           VolumeGradient& volume_gradient) {
  const Vector3 all[4] = {-(by_corner[0] + by_corner[1] + by_corner[2]), by_corner[0], by_corner[1],
                          by_corner[2]};
  for (int a = 0; a < 4; ++a) {
    store(&volume_gradient.by_corner[a][0][first], volume * all[a].x);
    store(&volume_gradient.by_corner[a][1][first], volume * all[a].y);
    store(&volume_gradient.by_corner[a][2][first], volume * all[a].z);
  }
}

/// A [v]×
inline Matrix3 times_cross(const Matrix3& A, const Vector3& v) {
  return {v.z * A.y - v.y * A.z, v.x * A.z - v.z * A.x, v.y * A.x - v.x * A.y};
}

/// [v]×ᵀ A
inline Matrix3 cross_times(const Vector3& v, const Matrix3& A) {
  return {cross(A.x, v), cross(A.y, v), cross(A.z, v)};
}

void add_corotational(const ElementBatch& batch, bool exact, const double* positions, double* forces,
                      double* blocks, VolumeGradient* volume_gradient) {
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

    Shares s;
    for (int b = 0; b < 3; ++b) s.force[b] = -(2 * mu * (F * g[b]) + c * h[b]);
    if (exact) {
      const Inversion T = invert_turning(M);
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

/// A + s [v]×
inline Matrix3 add_cross(const Matrix3& A, Packet s, const Vector3& v) {
  const Vector3 u = s * v;
  return {{A.x.x, A.x.y + u.z, A.x.z - u.y},
          {A.y.x - u.z, A.y.y, A.y.z + u.x},
          {A.z.x + u.y, A.z.y - u.x, A.z.z}};
}

void add_neo_hookean(const ElementBatch& batch, const double* positions, double* forces, double* blocks,
                     VolumeGradient* volume_gradient) {
  for (int first = 0; first < kBatchSize; first += kPacketSize) {
    const Packet V = load(&batch.volume[first]);
    const Packet mu = load(&batch.mu[first]) * V, stiff = load(&batch.lambda[first]) * V + mu;
    const Vector3 g[3] = {gradient(batch, 0, first), gradient(batch, 1, first), gradient(batch, 2, first)};
    const Edges edge = edges(batch, first, positions);
    const Matrix3 F = deformation_gradient(batch, first, edge);
    // J is the ratio of the parallelepipeds that the edges span now and at rest.
    const Packet per_volume = dot(g[0], cross(g[1], g[2]));
    const Vector3 c[3] = {per_volume * cross(edge.e[1], edge.e[2]), per_volume * cross(edge.e[2], edge.e[0]),
                          per_volume * cross(edge.e[0], edge.e[1])};
    const Packet theta = dot(edge.e[0], c[0]) - 1;
    const Packet q = stiff * theta + load(&batch.pressure[first]) * V - mu;
    if (volume_gradient) store_volume_gradient(c, V, first, *volume_gradient);

    Shares s;
    for (int b = 0; b < 3; ++b) s.force[b] = -(mu * (F * g[b]) + q * c[b]);
    const auto block = [&](int a, int b) {
      return add_to_diagonal(outer(stiff * c[a], c[b]), mu * dot(g[a], g[b]));
    };
    // c_1 = e_2 × e_3 / D, so ∂c_2/∂x_1 = [e_3]×/D and so on round.
    const Packet turn = q * per_volume;
    s.K11 = block(0, 0), s.K22 = block(1, 1), s.K33 = block(2, 2);
    s.K21 = add_cross(block(1, 0), turn, edge.e[2]);
    s.K31 = add_cross(block(2, 0), -turn, edge.e[1]);
    s.K32 = add_cross(block(2, 1), turn, edge.e[0]);
    scatter_add(s, batch, first, forces, blocks);
  }
}

}  // namespace

extern const ElementKernels TENDRIL_ELEMENT_KERNELS{rotate, dilate, add_corotational, add_neo_hookean};

}  // namespace tendril::fem
