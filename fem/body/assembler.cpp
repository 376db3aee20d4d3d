// SPDX-License-Identifier: Apache-2.0
#include "fem/body/assembler.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>

namespace tendril::fem {
namespace {

/// Corners in ascending order: each block of the element is then one of the lower triangle, not transposed.
std::array<int, 4> ascending(std::array<int, 4> tet) {
  std::sort(tet.begin(), tet.end());
  return tet;
}

/// Slot of a block; the discard slot for a fixed node.
int slot(const StiffnessMatrix& pattern, int row, int column) {
  return row < pattern.nodes() ? pattern.slot(row, column) : pattern.discard_slot();
}

}  // namespace

Assembler::Assembler(const Model& model, const StiffnessMatrix& pattern, InstructionSet set)
    : model_(model),
      set_(set),
      batch_and_lane_(model.tetrahedra().size()),
      positions_(Eigen::Matrix4Xd::Zero(4, model.mesh().node_count())),
      forces_(positions_) {
  positions_.topRows<3>() = model.mesh().nodes;

  for (const bool patched : {true, false}) {
    for (const Law law : kLaws) add_batches(law, patched, pattern);
    if (patched) volume_gradients_.resize(batches_.size());
  }
  add_patches(pattern);
}

void Assembler::add_batches(Law law, bool patched, const StiffnessMatrix& pattern) {
  const auto& mesh = model_.mesh();
  std::vector<int> tets;
  for (int t = 0; t < mesh.tet_count(); ++t)
    if (model_.law(t) == law && (model_.patch_of(t) != kNoPatch) == patched) tets.push_back(t);
  // Neighbours share blocks. In successive batches they find these in the cache. In one batch, each lane
  // would wait until the lane before has added to the block.
  std::sort(tets.begin(), tets.end(),
            [&](int s, int t) { return ascending(mesh.tets[s]) < ascending(mesh.tets[t]); });
  const size_t batches = (tets.size() + kBatchSize - 1) / kBatchSize;
  for (size_t i = 0; i < batches; ++i) {
    std::vector<int> lanes;
    for (size_t k = i; k < tets.size(); k += batches) lanes.push_back(tets[k]);
    add_batch(lanes, pattern);
  }
}

void Assembler::add_batch(const std::vector<int>& tets, const StiffnessMatrix& pattern) {
  const int count = static_cast<int>(tets.size());
  ElementBatch batch{};
  for (int lane = 0; lane < kBatchSize; ++lane) {
    const bool used = lane < count;
    const int t = used ? tets[lane] : tets[0];
    if (used) batch_and_lane_[t] = {static_cast<int>(batches_.size()), lane};
    const std::array<int, 4> tet = ascending(model_.mesh().tets[t]);
    const RestTetrahedron rest = rest_tetrahedron(model_.mesh().nodes(Eigen::all, tet));
    batch.volume[lane] = used ? rest.volume : 0;
    batch.mu[lane] = model_.moduli(t).mu;
    batch.lambda[lane] = model_.moduli(t).lambda;
    batch.q[0][lane] = 1;
    for (int b = 0; b < 3; ++b)
      for (int c = 0; c < 3; ++c) batch.g[b][c][lane] = rest.g(c, b + 1);
    for (int a = 0, k = 0; a < 4; ++a) {
      batch.node[a][lane] = tet[a];
      for (int b = 0; b <= a; ++b, ++k)
        batch.block_offset[k][lane] = 9 * (used ? slot(pattern, tet[a], tet[b]) : pattern.discard_slot());
    }
  }
  elements_.push_back(batch);
  const Law law = model_.law(tets[0]);
  batches_.push_back({law, law.kernels(set_), model_.patch_of(tets[0]) != kNoPatch, count});
}

void Assembler::add_patches(const StiffnessMatrix& pattern) {
  for (size_t p = 0; p < model_.patches().size(); ++p) {
    const Patch& patch = model_.patches()[p];
    PatchAssembly assembly{model_.patch_modulus(p), patch.volume, {}, {}, {}};
    for (int t : patch.tets) {
      const auto [batch, lane] = batch_and_lane_[t];
      PatchElement element{batch, lane, ascending(model_.mesh().tets[t])};
      for (int& node : element.nodes)
        node = static_cast<int>(std::lower_bound(patch.nodes.begin(), patch.nodes.end(), node) -
                                patch.nodes.begin());
      assembly.elements.push_back(element);
    }
    for (size_t i = 0; i < patch.nodes.size(); ++i)
      for (size_t j = 0; j <= i; ++j) assembly.slots.push_back(slot(pattern, patch.nodes[i], patch.nodes[j]));
    assembly.volume_gradient.resize(3, std::ssize(patch.nodes));
    patches_.push_back(assembly);
  }
}

int Assembler::assemble(const Eigen::VectorXd& x, Tangent tangent, Eigen::VectorXd& f, StiffnessMatrix& K) {
  positions_.topLeftCorner(3, model_.free_nodes()) = x.reshaped(3, model_.free_nodes());
  forces_.setZero();
  K.set_zero();
  int inverted = 0;
  // The pressure of a patch needs the dilatation of all its elements.
  for (size_t i = 0; i < volume_gradients_.size(); ++i) inverted += update(i);
  update_patch_pressures();
  for (size_t i = 0; i < elements_.size(); ++i) {
    if (i >= volume_gradients_.size()) inverted += update(i);
    add_forces_and_stiffness(i, tangent, K);
  }
  for (PatchAssembly& patch : patches_) add_patch_coupling(patch, K);
  f = forces_.topLeftCorner(3, model_.free_nodes()).reshaped();
  return inverted;
}

/// @return  number of inverted elements
int Assembler::update(size_t i) {
  const Batch& batch = batches_[i];
  constexpr unsigned kAll = (1u << kBatchSize) - 1;
  const unsigned failed = batch.kernels.update ? batch.kernels.update(elements_[i], positions_.data()) : kAll;
  int inverted = 0;
  // Unused lanes do not count, but must recover from a pose that was not finite as well.
  for (int lane = 0; failed >> lane != 0 && lane < kBatchSize; ++lane)
    if (failed >> lane & 1) {
      const bool upright = batch.law.update_lane(elements_[i], lane, corners(elements_[i], lane));
      inverted += !upright && lane < batch.count;
    }
  return inverted;
}

Corners Assembler::corners(const ElementBatch& batch, int lane) const {
  Corners result;
  for (int a = 0; a < 4; ++a) result.col(a) = positions_.col(batch.node[a][lane]).head<3>();
  return result;
}

void Assembler::update_patch_pressures() {
  for (const PatchAssembly& patch : patches_) {
    double volume_change = 0;  // m³
    for (const PatchElement& m : patch.elements)
      volume_change += elements_[m.batch].volume[m.lane] * elements_[m.batch].theta[m.lane];
    for (const PatchElement& m : patch.elements)
      elements_[m.batch].pressure[m.lane] = patch.modulus * volume_change / patch.volume;
  }
}

void Assembler::add_forces_and_stiffness(size_t i, Tangent tangent, StiffnessMatrix& K) {
  const Batch& batch = batches_[i];
  const bool exact = tangent == Tangent::kExact;
  if (batch.kernels.add && (exact || batch.kernels.semidefinite))
    batch.kernels.add(elements_[i], exact, positions_.data(), forces_.data(), K.block(0),
                      batch.patched ? &volume_gradients_[i] : nullptr);
  else
    add_one_by_one(i, tangent, K);
}

void Assembler::add_one_by_one(size_t i, Tangent tangent, StiffnessMatrix& K) {
  for (int lane = 0; lane < batches_[i].count; ++lane) {
    const ElementBatch& batch = elements_[i];
    const RestTetrahedron rest = rest_tetrahedron(batch, lane);
    const Element element =
        batches_[i].law.element(rest, {batch.mu[lane], batch.lambda[lane]}, corners(batch, lane));
    std::visit([&](const auto& e) { add(e, i, lane, tangent, K); }, element);
  }
}

template <typename E>
void Assembler::add(const E& element, size_t i, int lane, Tangent tangent, StiffnessMatrix& K) {
  const ElementBatch& batch = elements_[i];
  const Corners f = element.forces(batch.pressure[lane]);
  for (int a = 0; a < 4; ++a) forces_.col(batch.node[a][lane]).head<3>() += f.col(a);
  const Blocks blocks = element.stiffness(tangent, batch.pressure[lane]);
  for (int k = 0; k < 10; ++k) K.add(batch.block_offset[k][lane] / 9, blocks[k]);
  if (!batches_[i].patched) return;
  const Corners volume_gradient = batch.volume[lane] * element.dilatation_gradient();
  for (int a = 0; a < 4; ++a)
    for (int c = 0; c < 3; ++c) volume_gradients_[i].by_corner[a][c][lane] = volume_gradient(c, a);
}

/// Adds (λ/V) b bᵀ, b the gradient of the patch's volume by its nodes, see Patch.
void Assembler::add_patch_coupling(PatchAssembly& patch, StiffnessMatrix& K) {
  auto& b = patch.volume_gradient;
  b.setZero();
  for (const PatchElement& m : patch.elements)
    for (int a = 0; a < 4; ++a)
      for (int c = 0; c < 3; ++c) b(c, m.nodes[a]) += volume_gradients_[m.batch].by_corner[a][c][m.lane];
  const double stiffness = patch.modulus / patch.volume;
  size_t k = 0;
  for (int i = 0; i < b.cols(); ++i) {
    const Eigen::Vector3d b_i = stiffness * b.col(i);
    for (int j = 0; j <= i; ++j, ++k) K.add(patch.slots[k], b_i * b.col(j).transpose());
  }
}

}  // namespace tendril::fem
