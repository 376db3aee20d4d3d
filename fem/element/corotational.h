// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "fem/element/element_kernels.h"
#include "fem/element/tetrahedron.h"
#include "fem/simd/simd.h"

namespace tendril::fem {

/// Rotation R of the polar decomposition F = R S with S symmetric: the rotation nearest to F.
///
/// Newton's iteration R ← (R + R⁻ᵀ)/2 [Higham, "Computing the polar decomposition", 1986]. For det F ≤ 0 the
/// singular value decomposition gives the rotation, with the sign of the smallest singular value changed.
/// @param F  3 × 3 deformation gradient, unitless
/// @return   3 × 3; F itself if F is not finite
/// Real-time: no (the decomposition iterates); allocates nothing.
Eigen::Matrix3d polar_rotation(const Eigen::Matrix3d& F);

/// The corotational linear tetrahedron at one deformation: linear elasticity in a frame that rotates with the
/// element [Müller & Gross, "Interactive Virtual Materials", 2004; Etzmuß et al. 2003].
///
/// With R from F = R S, V the rest volume, g_a = ∇N_a, and the dilatation θ = tr(S − I):
///   U   = V (μ ‖S − I‖² + λ/2 θ²)
///   f_a = −V P g_a,   P = R (2μ (S − I) + p I),   p = λ θ.
/// These forces are exactly −∂U/∂x_a, because R minimises ‖F − R‖ and maximises tr(RᵀF).
///
/// The exact tangent follows from dR = R [ω]×, ω = (tr(S) I − S)⁻¹ Σ_a g_a × (Rᵀ dx_a):
///   K_ab = V (2μ (g_a·g_b) I + λ h_a h_bᵀ + (p − 2μ) [h_a]×ᵀ B [h_b]×),
/// with h_a = R g_a and B = R (tr(S) I − S)⁻¹ Rᵀ. The semidefinite tangent holds the rotation fixed. It is
/// R K₀ Rᵀ, K₀ the stiffness at rest, as in SOFA:
///   K_ab = V (μ (g_a·g_b) I + μ h_b h_aᵀ + λ h_a h_bᵀ).
///
/// In a patch, λ is 0 and the pressure of the patch replaces p.
class CorotationalElement {
 public:
  static constexpr std::string_view kName = "corotational";  ///< in the robot file
  /// The same for a batch. Newton's method finds the rotation from the last one: R maximises tr(RᵀF). For
  /// R exp([ω]×) the gradient is the axial vector of RᵀF − FᵀR and the Hessian −(tr(S) I − S), with S the
  /// symmetric part of RᵀF.
  static ElementKernels kernels(InstructionSet set);
  /// See Law.
  static bool update_lane(ElementBatch& batch, int lane, const Corners& corners);

  /// Keeps a reference to `rest`.
  /// @param corners  3 × 4 present positions, m
  CorotationalElement(const RestTetrahedron& rest, const Moduli& moduli, const Corners& corners);

  bool inverted() const { return !(det_F_ > 0); }         ///< det F ≤ 0, or not finite
  const Eigen::Matrix3d& rotation() const { return R_; }  ///< R

  double energy() const;                ///< U, J, without that of the patch
  double dilatation() const;            ///< θ, unitless
  Corners dilatation_gradient() const;  ///< ∂θ/∂x_a, 3 × 4, 1/m

  /// f_a, 3 × 4, N.
  /// @param patch_pressure  Pa; 0 without a patch
  Corners forces(double patch_pressure = 0) const;
  /// K_ab, N/m, without the coupling by the patch.
  Blocks stiffness(Tangent tangent, double patch_pressure = 0) const;

 private:
  const RestTetrahedron& rest_;
  Moduli moduli_;
  double det_F_;
  Eigen::Matrix3d R_;
  Eigen::Matrix3d S_;
};

}  // namespace tendril::fem
