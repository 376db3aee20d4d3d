// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

namespace tendril::fem {

/// What is wrong with a mesh or its file, where, and what to do about it.
struct MeshError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A tetrahedral mesh with named sets of nodes and of tetrahedra.
struct Mesh {
  Eigen::Matrix3Xd nodes;                           ///< 3 × N positions at rest, m
  std::vector<std::array<int, 4>> tets;             ///< node indices from 0, positively oriented
  std::map<std::string, std::vector<int>> regions;  ///< name → node indices, ascending
  std::map<std::string, std::vector<int>> volumes;  ///< name → tetrahedron indices, ascending

  int node_count() const { return static_cast<int>(nodes.cols()); }
  int tet_count() const { return static_cast<int>(tets.size()); }
};

/// Signed volume of a tetrahedron with the corners a, b, c, d (m); positive when d lies on the side of the
/// right-handed normal of a, b, c.
/// @return  m³
double signed_volume(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                     const Eigen::Vector3d& d);

/// Refuses a mesh that no model can be built on: indices out of range, coordinates that are not finite,
/// inverted or flat tetrahedra, such as are there twice or overlap a neighbour, faces of more than two of
/// them, nodes that no tetrahedron uses, nodes at one place. Poorly shaped ones pass, see mesh_quality();
/// whether every part of the body is held is for the model to say.
/// @throws MeshError with the numbers (from 0) and places of the first few culprits
/// Real-time: no.
void check(const Mesh& mesh);

/// An axis-aligned box, borders included (m).
struct Box {
  Eigen::Vector3d lower, upper;
};

/// A ball, border included (m).
struct Sphere {
  Eigen::Vector3d centre;
  double radius;
};

/// A part of space that picks a part of a mesh.
using Space = std::variant<Box, Sphere>;

/// Indices of the nodes inside `space`, ascending.
/// Real-time: no (allocates).
std::vector<int> nodes_in(const Mesh& mesh, const Space& space);

/// Indices of the tetrahedra whose centroids are inside `space`, ascending.
/// Real-time: no (allocates).
std::vector<int> tets_in(const Mesh& mesh, const Space& space);

}  // namespace tendril::fem
