// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

#include "fem/mesh/mesh.h"

namespace tendril::fem {

/// A material point of the body: a weighted mean of the corners of one tetrahedron.
struct Attachment {
  std::array<int, 4> nodes;
  std::array<double, 4> weights;  ///< barycentric coordinates; they sum to 1
};

/// Attaches a point to the tetrahedron that contains it. A point outside the mesh, by at most `snap`, is
/// attached to the nearest tetrahedron. Its weights are then extrapolated, so that it keeps its position. But
/// if it is farther outside than the tetrahedron is high, it moves to the nearest point of the body: large
/// weights would multiply its efforts and motion.
/// @param point  m
/// @param snap   m
/// @throws MeshError with the distance and the nearest point if it is farther away
/// Real-time: no (searches all tetrahedra).
Attachment attach(const Mesh& mesh, const Eigen::Vector3d& point, double snap);

}  // namespace tendril::fem
