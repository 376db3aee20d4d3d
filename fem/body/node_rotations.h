// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fem/sparse/stiffness_matrix.h"

namespace tendril::fem {

/// The rotation of the body around each node from one pose to another: the polar rotation of
///   A_i = Σ_j (x_i − x_j)(x⁰_i − x⁰_j)ᵀ / ‖x⁰_i − x⁰_j‖²     j: nodes coupled with i.
class NodeRotations {
 public:
  /// Identities for so many nodes. Real-time: no (allocates).
  explicit NodeRotations(int nodes);

  /// Computes the rotations from pose `from` to pose `to` (3N, m).
  /// @param pattern  shows which nodes are coupled
  /// Real-time: no (time depends on the mesh); allocates nothing.
  void compute(const StiffnessMatrix& pattern, const Eigen::VectorXd& from, const Eigen::VectorXd& to);

  /// Sets all to the identity.
  void reset();

  const Eigen::Matrix3d& operator[](int node) const { return rotations_[node]; }

  /// v_i ← R_i v_i for the vectors of all nodes, or the inverse.
  /// Real-time: no (time depends on the mesh); allocates nothing.
  void rotate(EightVectors& V) const;
  void rotate_back(EightVectors& V) const;

 private:
  std::vector<Eigen::Matrix3d> rotations_;
};

}  // namespace tendril::fem
