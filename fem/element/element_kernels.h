// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tendril::fem {

inline constexpr int kBatchSize = 8;

/// Eight tetrahedra of one law; the last index, the lane, is the tetrahedron's. In a batch that is not full
/// the other lanes repeat one of its tetrahedra with volume 0, so that they add nothing.
struct alignas(64) ElementBatch {
  double g[3][3][kBatchSize];        ///< ∇N of corners 1 to 3, by corner and component, 1/m
  double volume[kBatchSize];         ///< at rest, m³
  double mu[kBatchSize];             ///< Pa
  double lambda[kBatchSize];         ///< Pa; 0 in a patch
  double pressure[kBatchSize];       ///< of the patch, Pa; 0 without one
  double theta[kBatchSize];          ///< dilatation at the last pose, unitless
  double q[4][kBatchSize];           ///< last rotation as a quaternion, scalar part first
  int node[4][kBatchSize];           ///< corners, ascending
  int block_offset[10][kBatchSize];  ///< of blocks 00, 10, 11, 20, 21, 22, 30, 31, 32, 33 in the stiffness
};

/// Gradients of the volumes of a batch by their corners: V ∂θ/∂x by corner and component, m².
struct alignas(64) VolumeGradient {
  double by_corner[4][3][kBatchSize];
};

/// The passes of one law over a batch, for one instruction set. A pass that is null is done element by
/// element.
///
/// positions (m), forces (N): four numbers a node, the last one unused. blocks: the numbers of a
/// StiffnessMatrix (N/m). Real-time: no (called for each batch of a mesh). A pass allocates nothing and each
/// of its loops has a fixed cap.
struct ElementKernels {
  /// Sets theta, and q if the law needs a rotation.
  /// @return  bit k is 1: lane k failed (inverted, or the search for its rotation found no maximum)
  unsigned (*update)(ElementBatch& batch, const double* positions) = nullptr;

  /// Adds forces and stiffness, after update().
  /// @param exact            the tangent; false only where `semidefinite`
  /// @param volume_gradient  overwritten unless it is null
  void (*add)(const ElementBatch& batch, bool exact, const double* positions, double* forces, double* blocks,
              VolumeGradient* volume_gradient) = nullptr;

  bool semidefinite = false;  ///< add() has the semidefinite tangent too
};

}  // namespace tendril::fem
