// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "fem/mesh/mesh.h"

namespace tendril::fem {

/// A triangle of nodes, seen counter-clockwise from the side that its normal points to.
using Face = std::array<int, 3>;

/// The surface of a body: faces that belong to one tetrahedron, seen counter-clockwise from outside the body.
/// Real-time: no (allocates).
std::vector<Face> boundary(const Mesh& mesh);

/// The nodes of faces, each once, in the order in which they come.
/// Real-time: no (allocates).
std::vector<int> nodes_of(const std::vector<Face>& faces);

/// The wall of the cavities that a set of nodes names: the faces of the body's surface whose corners are all
/// in it. Normals point out of the body, and so into a cavity. A set may name several cavities, which then
/// are one, as if a tube joined them.
/// @param nodes  indices of nodes of the mesh, in any order
/// @throws MeshError if there is no such face; with a place, if the wall is open, or is the outside of the
/// body Real-time: no (allocates).
std::vector<Face> closed_surface(const Mesh& mesh, const std::vector<int>& nodes);

/// The volume in a cavity with the mesh at rest.
/// @param wall  of closed_surface()
/// @return      m³
double enclosed_volume(const Mesh& mesh, const std::vector<Face>& wall);

/// Refuses a surface that leaks: each edge must be passed as often one way as the other.
/// @throws MeshError with the place of an open edge, or if there is no face
/// Real-time: no (allocates).
void check_closed(const Mesh& mesh, const std::vector<Face>& surface);

}  // namespace tendril::fem
