// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "fem/mesh/mesh.h"

namespace tendril::fem {

/// What becomes of nodes that no tetrahedron uses. Meshers write such, for the centre of a circle for
/// instance.
enum class LooseNodes {
  kKeptInGroups,  ///< those of a group stay in the mesh, for check() to refuse: somebody gave the group a
                  ///< name
  kDropped,       ///< none stays
};

/// Gathers a mesh from the cells of a file.
class MeshBuilder {
 public:
  /// @param nodes  3 × n positions; cells name them by their index
  explicit MeshBuilder(Eigen::Matrix3Xd nodes) { mesh_.nodes = std::move(nodes); }

  int node_count() const { return mesh_.node_count(); }

  /// The number of the group of that name, a new one where there is none yet.
  int group(const std::string& name);
  /// Adds a tetrahedron, and its corners, to the groups of these numbers.
  void add_tet(const std::array<int, 4>& corners, std::span<const int> groups);
  /// Adds the nodes of any other cell to the groups of these numbers.
  void add_nodes(std::span<const int> nodes, std::span<const int> groups);

  /// The mesh of all this. Nodes that neither a tetrahedron nor a group uses are left out.
  Mesh finish(LooseNodes loose) &&;

 private:
  struct Group {
    std::vector<int> nodes, tets;  // a node as often as it was added
  };

  Mesh mesh_;
  std::map<std::string, int> numbers_;
  std::vector<Group> groups_;
};

}  // namespace tendril::fem
