// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "fem/element/element_kernels.h"
#include "fem/element/tetrahedron.h"
#include "fem/simd/simd.h"

namespace tendril::fem {

/// The linear tetrahedron of a stable Neo-Hookean material at one deformation.
///
/// With V the rest volume, g_a = ∇N_a, J = det F, and the dilatation θ = J − 1:
///   U   = V (μ/2 (‖F‖² − 3) − μ θ + (μ + λ)/2 θ²)
///   f_a = −V (μ F g_a + q c_a),   q = −μ + μ θ + p,   p = λ θ,   c_a = ∂J/∂x_a = cof(F) g_a.
/// U is eq. 13 of Smith, de Goes & Kim, "Stable Neo-Hookean Flesh Simulation", 2018. Their second parameter
/// is λ + μ in place of Lamé's λ, so that small strains obey E and ν: at F = I the stress is 2μ ε + λ tr(ε)
/// I. The logarithm of their eq. 14, which guards an element squeezed to a point, is left out: a pose with
/// inverted elements is refused anyway. U is the energy of a material with ν = 0 and the same μ, plus λ/2 θ².
///
/// The exact tangent is
///   K_ab = V (μ (g_a·g_b) I + (μ + λ) c_a c_bᵀ + q ∂²J/∂x_a∂x_b).
/// The semidefinite tangent sets the negative eigenvalues of the 9 × 9 Hessian of U/V by F to zero [Teran et
/// al., "Robust Quasistatic Finite Elements and Flesh Simulation", 2005]. They are known from the singular
/// values of F [Smith et al. 2018, section 4]. Where none is negative, the tangent is the exact one.
///
/// In a patch, λ is 0 and the pressure of the patch replaces p.
class NeoHookeanElement {
 public:
  static constexpr std::string_view kName = "neo_hookean";  ///< in the robot file
  /// The same for a batch, without the semidefinite tangent: it is rarely needed, and a batch would save
  /// little of what the eigenvalues cost.
  static ElementKernels kernels(InstructionSet set);

  /// Keeps a reference to `rest`.
  /// @param corners  3 × 4 present positions, m
  NeoHookeanElement(const RestTetrahedron& rest, const Moduli& moduli, const Corners& corners);

  bool inverted() const { return !(J_ > 0); }  ///< J ≤ 0, or not finite

  double energy() const;                        ///< U, J, without that of the patch
  double dilatation() const { return J_ - 1; }  ///< θ, unitless
  Corners dilatation_gradient() const;          ///< ∂θ/∂x_a, 3 × 4, 1/m

  /// f_a, 3 × 4, N.
  /// @param patch_pressure  Pa; 0 without a patch
  Corners forces(double patch_pressure = 0) const;
  /// K_ab, N/m, without the coupling by the patch.
  Blocks stiffness(Tangent tangent, double patch_pressure = 0) const;

 private:
  using Hessian = Eigen::Matrix<double, 9, 9>;

  double q(double patch_pressure) const;
  Hessian hessian(double q) const;
  Hessian projected_hessian(double q) const;

  const RestTetrahedron& rest_;
  Moduli moduli_;
  Eigen::Matrix3d F_;
  Eigen::Matrix3d C_;  // cof F
  double J_;
};

}  // namespace tendril::fem
