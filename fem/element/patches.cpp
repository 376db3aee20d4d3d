// SPDX-License-Identifier: Apache-2.0
#include "fem/element/patches.h"

#include <Eigen/Dense>
#include <algorithm>
#include <map>
#include <set>

namespace tendril::fem {
namespace {

// Patches of 2³ tetrahedra leave a mesh with three to five unknowns for each condition on volume; de Souza
// Neto et al. (2005) use eight as well.
constexpr size_t kPatchSize = 8;
// A smaller patch would lock, so it is merged into its neighbours.
constexpr size_t kMinPatchSize = 4;

/// For each tetrahedron those of the same group that share a face with it.
std::vector<std::vector<int>> neighbours(const Mesh& mesh, const std::vector<int>& group) {
  std::map<std::array<int, 3>, int> open_faces;
  std::vector<std::vector<int>> result(mesh.tets.size());
  for (int t = 0; t < mesh.tet_count(); ++t)
    for (int opposite = 0; opposite < 4; ++opposite) {
      std::array<int, 3> face;
      for (int k = 0; k < 3; ++k) face[k] = mesh.tets[t][(opposite + 1 + k) % 4];
      std::sort(face.begin(), face.end());
      const auto [other, first] = open_faces.try_emplace(face, t);
      if (first || group[other->second] != group[t]) continue;
      result[t].push_back(other->second);
      result[other->second].push_back(t);
    }
  return result;
}

/// Divides a mesh greedily: each patch grows from a seed.
class PatchBuilder {
 public:
  PatchBuilder(const Mesh& mesh, const std::vector<int>& group)
      : mesh_(mesh), neighbours_(neighbours(mesh, group)), patch_(mesh.tets.size(), kNoPatch) {
    for (int t = 0; t < mesh.tet_count(); ++t)
      if (group[t] != kNoPatch && patch_[t] == kNoPatch) grow(t);
    for (size_t p = 0; p < members_.size(); ++p)
      if (members_[p].size() < kMinPatchSize) merge_into_neighbours(static_cast<int>(p));
  }

  const std::vector<std::vector<int>>& members() const { return members_; }

 private:
  void add(int tet, int patch) {
    patch_[tet] = patch;
    members_[patch].push_back(tet);
  }

  /// Grows a patch from one tetrahedron, each time by the neighbour with the fewest new nodes, and of those
  /// the nearest.
  void grow(int seed) {
    const int patch = static_cast<int>(members_.size());
    members_.emplace_back();
    add(seed, patch);
    std::set<int> nodes(mesh_.tets[seed].begin(), mesh_.tets[seed].end());
    while (members_[patch].size() < kPatchSize) {
      const int next = best_neighbour(patch, nodes);
      if (next == kNoPatch) return;
      add(next, patch);
      nodes.insert(mesh_.tets[next].begin(), mesh_.tets[next].end());
    }
  }

  int best_neighbour(int patch, const std::set<int>& nodes) const {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (int node : nodes) centre += mesh_.nodes.col(node) / static_cast<double>(nodes.size());
    int best = kNoPatch;
    std::pair<long, double> best_cost;
    for (int member : members_[patch])
      for (int t : neighbours_[member]) {
        if (patch_[t] != kNoPatch) continue;
        const auto& tet = mesh_.tets[t];
        const long new_nodes =
            std::count_if(tet.begin(), tet.end(), [&](int n) { return !nodes.contains(n); });
        const double distance = (mesh_.nodes(Eigen::all, tet).rowwise().mean() - centre).norm();
        const std::pair cost(new_nodes, distance);
        if (best == kNoPatch || cost < best_cost) best = t, best_cost = cost;
      }
    return best;
  }

  /// Gives each tetrahedron of a patch to the smallest patch around; one that has no neighbour stays.
  void merge_into_neighbours(int patch) {
    std::vector<int> pending;
    pending.swap(members_[patch]);
    for (bool moved = true; moved && !pending.empty();) {
      moved = false;
      for (size_t k = 0; k < pending.size(); ++k) {
        int smallest = kNoPatch;
        for (int t : neighbours_[pending[k]])
          if (const int p = patch_[t];
              p != patch && (smallest == kNoPatch || members_[p].size() < members_[smallest].size()))
            smallest = p;
        if (smallest == kNoPatch) continue;
        add(pending[k], smallest);
        pending.erase(pending.begin() + static_cast<long>(k--));
        moved = true;
      }
    }
    for (int t : pending) add(t, patch);
  }

  const Mesh& mesh_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<int> patch_;
  std::vector<std::vector<int>> members_;
};

}  // namespace

std::vector<Patch> make_patches(const Mesh& mesh, const std::vector<int>& group) {
  const PatchBuilder builder(mesh, group);
  std::vector<Patch> patches;
  for (const auto& tets : builder.members()) {
    if (tets.empty()) continue;
    Patch patch{tets, {}, 0};
    std::set<int> nodes;
    for (int t : tets) {
      const auto& [a, b, c, d] = mesh.tets[t];
      patch.volume +=
          signed_volume(mesh.nodes.col(a), mesh.nodes.col(b), mesh.nodes.col(c), mesh.nodes.col(d));
      nodes.insert(mesh.tets[t].begin(), mesh.tets[t].end());
    }
    patch.nodes.assign(nodes.begin(), nodes.end());
    patches.push_back(patch);
  }
  return patches;
}

}  // namespace tendril::fem
