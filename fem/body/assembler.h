#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "fem/body/model.h"
#include "fem/element/element_kernels.h"
#include "fem/sparse/stiffness_matrix.h"

namespace tendril::fem {

/// Internal forces and stiffness of a model, for one user of it, eight elements at a time.
///
/// It holds what a pass needs beyond the constant model: where each element's blocks go, and the rotations
/// found last, from which the next ones are sought. Results agree with the model's elements to rounding.
class Assembler {
 public:
  /// @param pattern  a matrix from Model::make_stiffness(); all such matrices of the same cliques are served
  /// @param kernels  the fastest ones unless a test wants others
  /// Keeps a reference to the model. Real-time: no (allocates).
  Assembler(const Model& model, const StiffnessMatrix& pattern,
            const ElementKernels& kernels = element_kernels());

  /// Internal forces f(x) (3N, N) and the tangent K(x) = −∂f/∂x (N/m), both overwritten.
  /// @return  number of elements that are inverted; 0 for a usable pose
  /// Real-time: no (time depends on the mesh); allocates nothing once f has its size.
  int assemble(const Eigen::VectorXd& x, Tangent tangent, Eigen::VectorXd& f, StiffnessMatrix& K);

 private:
  /// Elements of one law, all of them in patches or none.
  struct Batch {
    Law law;
    bool patched;
    int count;  // lanes in use
  };
  /// Where an element of a patch is, and its corners among the patch's nodes.
  struct PatchElement {
    int batch, lane;
    std::array<int, 4> nodes;
  };
  struct PatchAssembly {
    double modulus, volume;
    std::vector<PatchElement> elements;
    std::vector<int> slots;  // of all pairs of its nodes, row by row up to the diagonal
    Eigen::Matrix3Xd volume_gradient;
  };

  void add_batches(Law law, bool patched, const StiffnessMatrix& pattern);
  void add_batch(const std::vector<int>& tets, const StiffnessMatrix& pattern);
  void add_patches(const StiffnessMatrix& pattern);
  int deform(size_t batch);
  bool find_rotation(ElementBatch& batch, int lane) const;
  void update_patch_pressures();
  void add_forces_and_stiffness(size_t batch, Tangent tangent, StiffnessMatrix& K);
  void add_projected(size_t batch, StiffnessMatrix& K);
  void add_patch_coupling(PatchAssembly& patch, StiffnessMatrix& K);
  Corners corners(const ElementBatch& batch, int lane) const;

  const Model& model_;
  const ElementKernels& kernels_;
  std::vector<Batch> batches_;
  std::vector<ElementBatch> elements_;
  std::vector<VolumeGradient> volume_gradients_;    // of the first batches, which are the patched ones
  std::vector<std::array<int, 2>> batch_and_lane_;  // batch and lane
  std::vector<PatchAssembly> patches_;
  Eigen::Matrix4Xd positions_, forces_;  // of all nodes, the last row unused
};

}  // namespace tendril::fem
