// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numeric>
#include <vector>

namespace tendril::fem {

/// The part that each of `nodes` nodes belongs to, named by one of its nodes: cells (lists of nodes, as
/// tetrahedra or faces) of different parts share no node. Real-time: no (allocates).
template <typename Cells>
std::vector<int> connected_parts(int nodes, const Cells& cells) {
  std::vector<int> parent(nodes);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int node) {
    while (parent[node] != node) node = parent[node] = parent[parent[node]];
    return node;
  };
  for (const auto& cell : cells)
    for (int node : cell) parent[root(node)] = root(cell[0]);
  for (int node = 0; node < nodes; ++node) parent[node] = root(node);
  return parent;
}

}  // namespace tendril::fem
