#pragma once

namespace tendril::fem {

inline constexpr int kBatchSize = 8;

/// Eight tetrahedra of one law side by side, the last index being the tetrahedron's lane. In a batch that is
/// not full the other lanes repeat a tetrahedron with volume 0, so that they add nothing.
struct alignas(64) ElementBatch {
  double g[3][3][kBatchSize];   ///< ∇N of corners 1 to 3, by corner and component, 1/m
  double volume[kBatchSize];    ///< m³
  double mu[kBatchSize];        ///< Pa
  double lambda[kBatchSize];    ///< Pa; 0 where a patch resists the change of volume
  double pressure[kBatchSize];  ///< of that patch, Pa
  double theta[kBatchSize];     ///< dilatation, as measured last
  double q[4]
          [kBatchSize];  ///< rotation as a quaternion, scalar part first: where the next search for it starts
  int node[4][kBatchSize];           ///< corners, ascending
  int block_offset[10][kBatchSize];  ///< where blocks 00, 10, 11, 20, 21, 22, 30, 31, 32, 33 begin in the
                                     ///< stiffness
};

/// What a batch of a patch's tetrahedra resists with: V ∂θ/∂x by corner and component, m².
struct alignas(64) VolumeGradient {
  double by_corner[4][3][kBatchSize];
};

/// The passes over a batch. Positions and forces have four numbers a node, the last one unused.
/// All of them are bounded and allocate nothing; `rotate` caps its iterations.
struct ElementKernels {
  /// Polar rotation and dilatation of corotational elements, by Newton's method from the last rotation: the
  /// nearest rotation maximises tr(RᵀF), and for R exp([ω]×) the gradient is the axial vector of RᵀF − FᵀR,
  /// the Hessian −(tr(S) I − S) with S the symmetric part of RᵀF.
  /// @return  bits of the lanes to be done otherwise: inverted, not converged, or at a stationary point that
  /// is no
  ///          maximum, as tr(S) I − S, not positive definite there, tells
  unsigned (*rotate)(ElementBatch& batch, const double* positions);
  /// Dilatation of Neo-Hookean elements. @return  bits of the lanes that are inverted
  unsigned (*dilate)(ElementBatch& batch, const double* positions);

  /// Adds the forces and the stiffness of CorotationalElement, with the rotations that `rotate` left.
  /// @param volume_gradient  filled where given
  void (*add_corotational)(const ElementBatch& batch, bool exact, const double* positions, double* forces,
                           double* blocks, VolumeGradient* volume_gradient);
  /// Adds the forces and the exact stiffness of NeoHookeanElement.
  void (*add_neo_hookean)(const ElementBatch& batch, const double* positions, double* forces, double* blocks,
                          VolumeGradient* volume_gradient);
};

extern const ElementKernels kElementKernelsV3;
extern const ElementKernels kElementKernelsV4;  ///< x86 only

/// The fastest that this machine runs.
const ElementKernels& element_kernels();

}  // namespace tendril::fem
