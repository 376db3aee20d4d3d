// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/mesh_builder.h"

#include <algorithm>

namespace tendril::fem {

int MeshBuilder::group(const std::string& name) {
  const auto [entry, is_new] = numbers_.emplace(name, static_cast<int>(groups_.size()));
  if (is_new) groups_.emplace_back();
  return entry->second;
}

void MeshBuilder::add_tet(const std::array<int, 4>& corners, std::span<const int> groups) {
  for (const int group : groups) groups_[group].tets.push_back(mesh_.tet_count());
  mesh_.tets.push_back(corners);
  add_nodes(corners, groups);
}

void MeshBuilder::add_nodes(std::span<const int> nodes, std::span<const int> groups) {
  for (const int group : groups) {
    auto& known = groups_[group].nodes;
    known.insert(known.end(), nodes.begin(), nodes.end());
  }
}

Mesh MeshBuilder::finish(LooseNodes loose) && {
  std::vector<char> used(mesh_.node_count(), 0);
  for (const auto& tet : mesh_.tets)
    for (int node : tet) used[node] = 1;
  if (loose == LooseNodes::kKeptInGroups)
    for (const Group& group : groups_)
      for (int node : group.nodes) used[node] = 1;

  std::vector<int> numbering(mesh_.node_count());
  int kept = 0;
  for (int node = 0; node < mesh_.node_count(); ++node) {
    numbering[node] = kept;
    if (used[node]) mesh_.nodes.col(kept++) = mesh_.nodes.col(node);
  }
  mesh_.nodes.conservativeResize(Eigen::NoChange, kept);
  for (auto& tet : mesh_.tets)
    for (int& node : tet) node = numbering[node];

  for (const auto& [name, number] : numbers_) {
    auto& [nodes, tets] = groups_[number];
    std::erase_if(nodes, [&](int node) { return !used[node]; });
    for (int& node : nodes) node = numbering[node];
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    if (!nodes.empty()) mesh_.regions[name] = std::move(nodes);
    if (!tets.empty()) mesh_.volumes[name] = std::move(tets);
  }
  return std::move(mesh_);
}

}  // namespace tendril::fem
