#pragma once

#include <Eigen/Core>
#include <array>

#include "fem/mesh/mesh.h"

namespace tendril::fem {

/// A material point of the body: a weighted mean of the corners of one tetrahedron, with which it moves.
struct Attachment {
  std::array<int, 4> nodes;
  std::array<double, 4> weights;  ///< barycentric coordinates; they sum to 1
};

/// Attaches a point (m) to the tetrahedron that contains it, or, where it lies outside the mesh by no more
/// than `snap` (m), to the nearest one. Its weights are then extrapolated, so that it stays where it is; but
/// where it lies farther from that tetrahedron than this is high, it moves to the nearest place of the body,
/// for the weights of an arm that long would multiply its efforts and its motion.
/// @throws MeshError with the distance and the nearest place if the point is farther away
/// Real-time: no (searches all tetrahedra).
Attachment attach(const Mesh& mesh, const Eigen::Vector3d& point, double snap);

}  // namespace tendril::fem
