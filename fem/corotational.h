#pragma once

#include <Eigen/Core>
#include <array>

#include "fem/material.h"

namespace tendril::fem {

/// What a linear tetrahedron keeps of its shape at rest.
struct RestTetrahedron {
  double volume;                  ///< V, m³
  Eigen::Matrix<double, 3, 4> g;  ///< columns g_a = ∇N_a, 1/m; they sum to zero
};

/// @param corners  3 × 4 positions at rest, m; positively oriented
RestTetrahedron rest_tetrahedron(const Eigen::Matrix<double, 3, 4>& corners);

/// Rotation R of the polar decomposition F = R S with S symmetric: the rotation nearest to F.
/// Newton's iteration R ← (R + R⁻ᵀ)/2 [Higham, "Computing the polar decomposition", 1986]; an inverted F
/// (det F ≤ 0) takes the rotation of its singular value decomposition with the smallest value's sign flipped.
/// @param F  deformation gradient, unitless
Eigen::Matrix3d polar_rotation(const Eigen::Matrix3d& F);

/// Which derivative of the forces a stiffness holds.
enum class Tangent {
  kExact,  ///< −∂f/∂x in full, the turning of the element's frame included; may lose definiteness
  kFrozenRotation,  ///< R K₀ Rᵀ: leaves out ∂R/∂x, always semidefinite (SOFA's and the paper's tangent)
};

/// The corotational linear tetrahedron at one deformation.
///
/// Energy U = V (μ ‖S − I‖² + λ/2 tr(S − I)²) with S = RᵀF: small-strain elasticity seen in the frame that
/// turns with the element [Müller & Gross, "Interactive Virtual Materials", 2004; Etzmuß et al. 2003]. With R
/// from the polar decomposition the nodal forces f_a = −V P g_a, P = R (2μ (S − I) + λ tr(S − I) I), are
/// exactly −∂U/∂x_a, because R is the rotation that makes ‖F − R‖ smallest and tr(RᵀF) largest.
///
/// The exact tangent follows from dR = R [ω]×, ω = (tr(S) I − S)⁻¹ Σ_a g_a × (Rᵀ dx_a):
///   K_ab = V (2μ (g_a·g_b) I + λ h_a h_bᵀ + (λ tr(S − I) − 2μ) [h_a]×ᵀ B [h_b]×),
/// with h_a = R g_a and B = R (tr(S) I − S)⁻¹ Rᵀ. With the rotation frozen,
///   K_ab = V (μ (g_a·g_b) I + μ h_b h_aᵀ + λ h_a h_bᵀ).
class CorotationalElement {
 public:
  /// @param corners  3 × 4 present positions, m
  CorotationalElement(const RestTetrahedron& rest, const Material& material,
                      const Eigen::Matrix<double, 3, 4>& corners);

  double energy() const;                         ///< U, J
  Eigen::Matrix<double, 3, 4> forces() const;    ///< f_a as columns, N
  bool inverted() const { return det_F_ <= 0; }  ///< turned inside out
  const Eigen::Matrix3d& rotation() const { return R_; }

  /// The blocks K_ab, a ≥ b, of −∂f/∂x, N/m, row-wise: 00, 10, 11, 20, 21, 22, 30, 31, 32, 33.
  std::array<Eigen::Matrix3d, 10> stiffness(Tangent tangent) const;

 private:
  const RestTetrahedron& rest_;
  double mu_, lambda_;
  double det_F_;
  Eigen::Matrix3d R_;
  Eigen::Matrix3d S_;
};

}  // namespace tendril::fem
