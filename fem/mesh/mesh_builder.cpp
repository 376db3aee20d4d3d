#include "fem/mesh/mesh_builder.h"

namespace tendril::fem {

void MeshBuilder::add_tet(const std::array<int, 4>& corners, std::span<const std::string> groups) {
  for (const std::string& group : groups) mesh_.volumes[group].push_back(mesh_.tet_count());
  mesh_.tets.push_back(corners);
  add_nodes(corners, groups);
}

void MeshBuilder::add_nodes(std::span<const int> nodes, std::span<const std::string> groups) {
  for (const std::string& group : groups) groups_[group].insert(nodes.begin(), nodes.end());
}

Mesh MeshBuilder::finish() && {
  std::vector<char> used(mesh_.node_count(), 0);
  for (const auto& tet : mesh_.tets)
    for (int node : tet) used[node] = 1;
  for (const auto& [name, nodes] : groups_)
    for (int node : nodes) used[node] = 1;

  std::vector<int> numbering(mesh_.node_count());
  int kept = 0;
  for (int node = 0; node < mesh_.node_count(); ++node) {
    numbering[node] = kept;
    if (used[node]) mesh_.nodes.col(kept++) = mesh_.nodes.col(node);
  }
  mesh_.nodes.conservativeResize(Eigen::NoChange, kept);
  for (auto& tet : mesh_.tets)
    for (int& node : tet) node = numbering[node];
  for (const auto& [name, nodes] : groups_)
    for (int node : nodes) mesh_.regions[name].push_back(numbering[node]);
  return std::move(mesh_);
}

}  // namespace tendril::fem
