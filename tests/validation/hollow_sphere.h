// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "fem/mesh/mesh.h"

namespace tendril::validation {

/// A hollow sphere around the origin: layers of prisms over a subdivided icosahedron, each cut into three
/// tetrahedra.
struct HollowSphere {
  std::vector<double> radii;                  ///< of the layers of nodes, ascending, m
  int nodes_a_layer;                          ///< node s of layer k is k · nodes_a_layer + s
  std::vector<std::array<int, 3>> triangles;  ///< of a layer, counter-clockwise seen from outside the sphere
  fem::Mesh mesh;                             ///< tetrahedra layer by layer, from inside to outside
};

/// @param radii      two or more, ascending, m
/// @param frequency  parts that each edge of the icosahedron is cut into
HollowSphere hollow_sphere(const std::vector<double>& radii, int frequency);

}  // namespace tendril::validation
