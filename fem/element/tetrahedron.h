// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

namespace tendril::fem {

/// Positions (m) of the four corners, or forces (N) on them, as columns.
using Corners = Eigen::Matrix<double, 3, 4>;

/// The blocks K_ab, a ≥ b, of a tetrahedron's stiffness (N/m), row by row: 00, 10, 11, 20, 21, 22, 30, 31,
/// 32, 33.
using Blocks = std::array<Eigen::Matrix3d, 10>;

/// The rest shape of a linear tetrahedron.
struct RestTetrahedron {
  double volume;  ///< V, m³, positive for each order of the corners
  Corners g;      ///< columns g_a = ∇N_a, 1/m; they sum to zero
};

/// @param corners  3 × 4 positions at rest, m
RestTetrahedron rest_tetrahedron(const Corners& corners);

struct ElementBatch;

/// The rest shape of one lane.
RestTetrahedron rest_tetrahedron(const ElementBatch& batch, int lane);

/// Cofactor matrix of A: det(A) A⁻ᵀ where A is regular.
Eigen::Matrix3d cofactors(const Eigen::Matrix3d& A);

/// The matrix [v]× with [v]× w = v × w.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

/// Lamé's parameters of a tetrahedron, Pa. λ is 0 in a patch, which resists the change of volume instead.
struct Moduli {
  double mu;
  double lambda;
};

/// Which derivative of the forces a stiffness matrix is.
enum class Tangent {
  kExact,         ///< −∂f/∂x in full; may be indefinite
  kSemidefinite,  ///< an approximation that is never indefinite, see the elements
};

}  // namespace tendril::fem
