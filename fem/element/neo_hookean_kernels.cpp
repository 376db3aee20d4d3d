// SPDX-License-Identifier: Apache-2.0
// The formulas of NeoHookeanElement for a batch of elements. Compiled once for each instruction set: see
// simd.h for what may stand here.
#include "fem/element/batch_operations.h"

namespace tendril::fem::TENDRIL_INSTRUCTION_SET {
namespace {

unsigned update_dilatations(ElementBatch& batch, const double* positions) {
  unsigned inverted = 0;
  for (int first = 0; first < kBatchSize; first += kPacketSize) {
    const Matrix3 F = deformation_gradient(batch, first, edges(batch, first, positions));
    const Packet J = dot(F.x, cross(F.y, F.z));
    store(&batch.theta[first], J - 1);
    inverted |= bits(~(J > 0)) << first;
  }
  return inverted;
}

/// A + s [v]×
inline Matrix3 add_cross(const Matrix3& A, Packet s, const Vector3& v) {
  const Vector3 u = s * v;
  return {{A.x.x, A.x.y + u.z, A.x.z - u.y},
          {A.y.x - u.z, A.y.y, A.y.z + u.x},
          {A.z.x + u.y, A.z.y - u.x, A.z.z}};
}

void add(const ElementBatch& batch, bool, const double* positions, double* forces, double* blocks,
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

    NodalShares s;
    for (int b = 0; b < 3; ++b) s.force[b] = -(mu * (F * g[b]) + q * c[b]);
    const auto block = [&](int a, int b) {
      return add_to_diagonal(outer(stiff * c[a], c[b]), mu * dot(g[a], g[b]));
    };
    // c_1 = e_2 × e_3 / D, so ∂c_2/∂x_1 = [e_3]×/D, and cyclic.
    const Packet turn = q * per_volume;
    s.K11 = block(0, 0), s.K22 = block(1, 1), s.K33 = block(2, 2);
    s.K21 = add_cross(block(1, 0), turn, edge.e[2]);
    s.K31 = add_cross(block(2, 0), -turn, edge.e[1]);
    s.K32 = add_cross(block(2, 1), turn, edge.e[0]);
    scatter_add(s, batch, first, forces, blocks);
  }
}

}  // namespace

extern const ElementKernels kNeoHookeanKernels{update_dilatations, add, false};

}  // namespace tendril::fem::TENDRIL_INSTRUCTION_SET
