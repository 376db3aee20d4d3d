#pragma once

#include <Eigen/Core>

#include "fem/element/tetrahedron.h"

namespace tendril::fem {

/// Rotation R of the polar decomposition F = R S with S symmetric: the rotation nearest to F.
/// Newton's iteration R ← (R + R⁻ᵀ)/2 [Higham, "Computing the polar decomposition", 1986]; an inverted F
/// (det F ≤ 0) takes the rotation of its singular value decomposition with the smallest value's sign flipped.
/// @param F  deformation gradient, unitless
Eigen::Matrix3d polar_rotation(const Eigen::Matrix3d& F);

/// The corotational linear tetrahedron at one deformation.
///
/// Energy U = V (μ ‖S − I‖² + λ/2 θ²) with S = RᵀF and the dilatation θ = tr(S − I): small-strain elasticity
/// seen in the frame that turns with the element [Müller & Gross, "Interactive Virtual Materials", 2004;
/// Etzmuß et al. 2003]. With R from the polar decomposition the nodal forces f_a = −V P g_a, P = R (2μ (S −
/// I) + p I), p = λ θ, are exactly −∂U/∂x_a, because R is the rotation that makes ‖F − R‖ smallest and
/// tr(RᵀF) largest.
///
/// The exact tangent follows from dR = R [ω]×, ω = (tr(S) I − S)⁻¹ Σ_a g_a × (Rᵀ dx_a):
///   K_ab = V (2μ (g_a·g_b) I + λ h_a h_bᵀ + (p − 2μ) [h_a]×ᵀ B [h_b]×),
/// with h_a = R g_a and B = R (tr(S) I − S)⁻¹ Rᵀ. The semidefinite one holds the rotation fixed, R K₀ Rᵀ with
/// K₀ the stiffness at rest (SOFA's and the paper's tangent):
///   K_ab = V (μ (g_a·g_b) I + μ h_b h_aᵀ + λ h_a h_bᵀ).
///
/// Where a patch resists the change of volume, λ is zero and the patch's pressure stands for p.
class CorotationalElement {
 public:
  /// @param corners  3 × 4 present positions, m
  CorotationalElement(const RestTetrahedron& rest, const Moduli& moduli, const Corners& corners);

  bool inverted() const { return !(det_F_ > 0); }  ///< turned inside out, or not finite
  const Eigen::Matrix3d& rotation() const { return R_; }

  double energy() const;                            ///< U, J
  double dilatation() const;                        ///< θ
  Corners dilatation_gradient() const;              ///< ∂θ/∂x_a as columns, 1/m
  Corners forces(double patch_pressure = 0) const;  ///< f_a as columns, N; of a pressure in Pa
  Blocks stiffness(Tangent tangent, double patch_pressure = 0) const;  ///< N/m

 private:
  const RestTetrahedron& rest_;
  Moduli moduli_;
  double det_F_;
  Eigen::Matrix3d R_;
  Eigen::Matrix3d S_;
};

}  // namespace tendril::fem
