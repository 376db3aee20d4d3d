// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "fem/mesh/mesh.h"

namespace tendril::fem {

/// Refuses a body of which a part can turn against the rest: one that has no face in common with it, but only
/// a node or the nodes of an edge. Parts whose common nodes span a triangle hold each other, and so do a part
/// and the fixed nodes. Parts in a ring, each hinged to the next, may hold each other too, but are refused.
/// @param fixed  the nodes that are fixed
/// @throws MeshError with the place of a node or an edge by which a part hangs
/// Real-time: no (allocates).
void check_hinges(const Mesh& mesh, std::span<const int> fixed);

}  // namespace tendril::fem
