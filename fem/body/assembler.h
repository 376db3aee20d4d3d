// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "fem/body/model.h"
#include "fem/element/element_kernels.h"
#include "fem/sparse/stiffness_matrix.h"

namespace tendril::fem {

/// Internal forces and stiffness of a model, eight elements at a time. Each user of a model needs its own.
///
/// It keeps where each element's blocks are in the matrix, and the last rotations, from which the search for
/// the next ones starts. Results agree with Model::internal_forces() to rounding.
class Assembler {
 public:
  /// Keeps a reference to the model.
  /// @param pattern  a matrix from Model::make_stiffness(); assemble() takes all matrices of the same cliques
  /// @param set      whose kernels to use; tests compare them
  /// Real-time: no (allocates).
  Assembler(const Model& model, const StiffnessMatrix& pattern, InstructionSet set = best_instruction_set());

  /// Internal forces f(x) and the tangent K(x) = −∂f/∂x.
  /// @param x  3N, m
  /// @param f  overwritten, 3N, N
  /// @param K  overwritten, 3N × 3N, N/m
  /// @return   number of inverted elements; unless it is 0, f and K are of no use
  /// Real-time: no (time depends on the mesh); allocates nothing once f has its size.
  int assemble(const Eigen::VectorXd& x, Tangent tangent, Eigen::VectorXd& f, StiffnessMatrix& K);

 private:
  /// Elements of one law, all of them in patches or none.
  struct Batch {
    Law law;
    ElementKernels kernels;
    bool patched;
    int count;  // lanes in use
  };
  /// Where an element of a patch is, and its corners as indices into the patch's nodes.
  struct PatchElement {
    int batch, lane;
    std::array<int, 4> nodes;
  };
  struct PatchAssembly {
    double modulus;  // λ, Pa
    double volume;   // at rest, m³
    std::vector<PatchElement> elements;
    std::vector<int> slots;            // of all pairs of its nodes, row by row up to the diagonal
    Eigen::Matrix3Xd volume_gradient;  // b, m²
  };

  void add_batches(Law law, bool patched, const StiffnessMatrix& pattern);
  void add_batch(const std::vector<int>& tets, const StiffnessMatrix& pattern);
  void add_patches(const StiffnessMatrix& pattern);
  int update(size_t batch);
  void update_patch_pressures();
  void add_forces_and_stiffness(size_t batch, Tangent tangent, StiffnessMatrix& K);
  void add_one_by_one(size_t batch, Tangent tangent, StiffnessMatrix& K);
  template <typename E>
  void add(const E& element, size_t batch, int lane, Tangent tangent, StiffnessMatrix& K);
  void add_patch_coupling(PatchAssembly& patch, StiffnessMatrix& K);
  Corners corners(const ElementBatch& batch, int lane) const;

  const Model& model_;
  InstructionSet set_;
  std::vector<Batch> batches_;
  std::vector<ElementBatch> elements_;
  std::vector<VolumeGradient> volume_gradients_;    // of the patched batches, which come first
  std::vector<std::array<int, 2>> batch_and_lane_;  // of each tetrahedron
  std::vector<PatchAssembly> patches_;
  Eigen::Matrix4Xd positions_, forces_;  // of all nodes, the last row unused
};

}  // namespace tendril::fem
