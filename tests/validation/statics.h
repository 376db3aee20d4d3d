// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <string>
#include <vector>

#include "fem/body/model.h"

namespace tendril::validation {

/// A material and what the page calls it.
struct NamedMaterial {
  std::string name;
  fem::Material material;
};

/// The same small-strain elasticity in both laws.
/// @param young_modulus  Pa
std::vector<NamedMaterial> laws(double young_modulus, double poisson_ratio);

/// A dead load at a node of the mesh that the model was built from.
struct NodalLoad {
  int node;
  Eigen::Vector3d force;  ///< N
};

/// A node of the mesh that the model was built from, as a place of the model.
fem::Attachment at_node(const fem::Model& model, int node);

/// Where a node of the mesh that the model was built from has gone, m.
Eigen::Vector3d displacement(const fem::Model& model, const Eigen::VectorXd& x, int node);

/// Equilibrium under dead loads, which stay on the model afterwards.
/// @param start  3N, m, where the iteration begins
/// @param steps  the loads grow in as many equal steps
/// @return  x, 3N, m
/// @throws  std::runtime_error if the body does not come to rest
Eigen::VectorXd settle(fem::Model& model, const Eigen::VectorXd& start, const std::vector<NodalLoad>& loads,
                       int steps = 1);

/// K at rest, 3N × 3N, N/m.
Eigen::SparseMatrix<double> stiffness_at_rest(const fem::Model& model);

}  // namespace tendril::validation
