// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fem/body/model.h"

namespace tendril::validation {

/// One static analysis by CalculiX (ccx): the same mesh of linear tetrahedra (C3D4), the same nodes fixed,
/// dead loads on nodes that grow from step to step, large displacements (*STEP, NLGEOM).
struct CalculixJob {
  const fem::Model& model;
  fem::Material material;
  std::vector<Eigen::VectorXd> loads;  ///< of every step, 3N, N

  /// Displacements of the free nodes at the end of every step, 3N, m. Each is known to seven digits.
  /// @throws std::runtime_error if ccx fails, with the path of what it said
  std::vector<Eigen::VectorXd> run() const;
};

/// Whether ccx can be started.
bool calculix_is_here();

}  // namespace tendril::validation
