#pragma once

#include <Eigen/Core>
#include <vector>

#include "fem/model.h"
#include "fem/stiffness_matrix.h"

namespace tendril::fem {

/// Internal forces and stiffness of a model, for one user of it: what a pass over all elements needs beyond
/// the model itself, so that it allocates nothing.
class Assembler {
 public:
  /// @param pattern  a matrix from Model::make_stiffness(); all such matrices of the same cliques are served
  /// Keeps a reference to the model. Real-time: no (allocates).
  Assembler(const Model& model, const StiffnessMatrix& pattern);

  /// Internal forces f(x) (3N, N) and the tangent K(x) = −∂f/∂x (N/m), both overwritten.
  /// @return  number of elements that are inverted; 0 for a usable pose
  /// Real-time: no (time depends on the mesh); allocates nothing once f has its size.
  int assemble(const Eigen::VectorXd& x, Tangent tangent, Eigen::VectorXd& f, StiffnessMatrix& K);

 private:
  const Model& model_;
};

}  // namespace tendril::fem
