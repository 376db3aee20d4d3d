#pragma once

#include <Eigen/Core>
#include <vector>

#include "fem/sparse/stiffness_matrix.h"

namespace tendril::fem {

/// How the body around each node has turned from one pose to another: the rotation that takes the ways from
/// the node to its neighbours nearest to what they are in the other pose, each counted by its direction
/// alone.
class NodeRotations {
 public:
  /// No turns, of so many nodes. Real-time: no (allocates).
  explicit NodeRotations(int nodes);

  /// Sets the rotations from pose `from` to pose `to` (3N, m).
  /// @param pattern  nodes that it couples are neighbours
  /// Real-time: no (time depends on the mesh); allocates nothing.
  void compute(const StiffnessMatrix& pattern, const Eigen::VectorXd& from, const Eigen::VectorXd& to);

  /// Sets all of them to no turn.
  void reset();

  const Eigen::Matrix3d& operator[](int node) const { return rotations_[node]; }

  /// Turns all vectors of the nodes along, or back.
  /// Real-time: no (time depends on the mesh); allocates nothing.
  void rotate(EightVectors& V) const;
  void rotate_back(EightVectors& V) const;

 private:
  std::vector<Eigen::Matrix3d> rotations_;
};

}  // namespace tendril::fem
