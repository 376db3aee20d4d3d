#pragma once

#include <array>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "fem/mesh/mesh.h"

namespace tendril::fem {

/// Gathers a mesh from the cells of a file.
class MeshBuilder {
 public:
  /// @param nodes  3 × n positions; cells name them by their index
  explicit MeshBuilder(Eigen::Matrix3Xd nodes) { mesh_.nodes = std::move(nodes); }

  int node_count() const { return mesh_.node_count(); }

  /// Adds a tetrahedron, and its corners, to the groups of these names.
  void add_tet(const std::array<int, 4>& corners, std::span<const std::string> groups);
  /// Adds the nodes of any other cell to the groups of these names.
  void add_nodes(std::span<const int> nodes, std::span<const std::string> groups);

  /// The mesh of all this. Nodes that neither a tetrahedron nor a group uses are left out: meshers write
  /// such, for the centre of a circle for instance.
  Mesh finish() &&;

 private:
  Mesh mesh_;
  std::map<std::string, std::set<int>> groups_;
};

}  // namespace tendril::fem
