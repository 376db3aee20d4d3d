#pragma once

#include <Eigen/Core>
#include <array>

namespace tendril::fem {

/// Positions of, or forces on, the four corners, as columns.
using Corners = Eigen::Matrix<double, 3, 4>;

/// The blocks K_ab, a ≥ b, of a tetrahedron's stiffness, row-wise: 00, 10, 11, 20, 21, 22, 30, 31, 32, 33.
using Blocks = std::array<Eigen::Matrix3d, 10>;

/// What a linear tetrahedron keeps of its shape at rest.
struct RestTetrahedron {
  double volume;  ///< V, m³, positive in whichever order the corners stand
  Corners g;      ///< columns g_a = ∇N_a, 1/m; they sum to zero
};

/// @param corners  3 × 4 positions at rest, m
RestTetrahedron rest_tetrahedron(const Corners& corners);

/// Cofactor matrix of A: det(A) A⁻ᵀ where A is regular.
Eigen::Matrix3d cofactors(const Eigen::Matrix3d& A);

/// The matrix [v]× with [v]× w = v × w.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

/// What a tetrahedron by itself resists with, Pa. λ is 0 where a patch resists the change of volume.
struct Moduli {
  double mu;
  double lambda;
};

/// Which derivative of the forces a stiffness holds.
enum class Tangent {
  kExact,         ///< −∂f/∂x in full; may lose definiteness
  kSemidefinite,  ///< close to it and never indefinite, see the elements
};

}  // namespace tendril::fem
