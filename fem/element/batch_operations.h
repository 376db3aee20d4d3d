// SPDX-License-Identifier: Apache-2.0
// What the kernels of all laws share: the deformation of a batch of elements, and the sums of forces and
// stiffness over the nodes. For kernel sources alone, see simd.h.
#pragma once

#include "fem/element/element_kernels.h"
#include "fem/simd/packet.h"

namespace tendril::fem {
namespace {

/// The edges from corner 0 to corners 1, 2 and 3, m.
struct Edges {
  Vector3 e[3];
};

inline Edges edges(const ElementBatch& batch, int first, const double* positions) {
  const Vector3 origin = gather(positions, &batch.node[0][first]);
  Edges result;
  for (int b = 0; b < 3; ++b) result.e[b] = gather(positions, &batch.node[b + 1][first]) - origin;
  return result;
}

/// ∇N of corner b + 1, 1/m.
inline Vector3 gradient(const ElementBatch& batch, int b, int first) {
  return {load(&batch.g[b][0][first]), load(&batch.g[b][1][first]), load(&batch.g[b][2][first])};
}

/// F, unitless.
inline Matrix3 deformation_gradient(const ElementBatch& batch, int first, const Edges& edges) {
  const Vector3 g1 = gradient(batch, 0, first), g2 = gradient(batch, 1, first),
                g3 = gradient(batch, 2, first);
  return outer(edges.e[0], g1) + outer(edges.e[1], g2) + outer(edges.e[2], g3);
}

/// Forces (N) and stiffness blocks (N/m) of corners 1 to 3. Those of corner 0 follow: all sums over the
/// corners are 0.
struct NodalShares {
  Vector3 force[3];
  Matrix3 K11, K21, K22, K31, K32, K33;
};

// The compiler would inline the two below, and then run out of registers: 3 % more instructions.

/// Adds the forces to the nodes and the blocks to the stiffness.
[[gnu::noinline]] void scatter_add(const NodalShares& s, const ElementBatch& batch, int first, double* forces,
                                   double* blocks) {
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

/// @param by_corner  ∂θ/∂x of corners 1 to 3, 1/m
[[gnu::noinline]] void store_volume_gradient(const Vector3 (&by_corner)[3], Packet volume, int first,
                                             VolumeGradient& volume_gradient) {
  const Vector3 all[4] = {-(by_corner[0] + by_corner[1] + by_corner[2]), by_corner[0], by_corner[1],
                          by_corner[2]};
  for (int a = 0; a < 4; ++a) {
    store(&volume_gradient.by_corner[a][0][first], volume * all[a].x);
    store(&volume_gradient.by_corner[a][1][first], volume * all[a].y);
    store(&volume_gradient.by_corner[a][2][first], volume * all[a].z);
  }
}

}  // namespace
}  // namespace tendril::fem
