#pragma once

#include <Eigen/Core>

#include "fem/element/tetrahedron.h"

namespace tendril::fem {

/// The linear tetrahedron of a stable Neo-Hookean material at one deformation.
///
/// Energy U = V (μ/2 (‖F‖² − 3) − μ θ + (μ + λ)/2 θ²), θ = J − 1, J = det F: eq. 13 of Smith, de Goes & Kim,
/// "Stable Neo-Hookean Flesh Simulation", 2018. Their second parameter is λ + μ in place of Lamé's λ, so that
/// small strains obey E and ν: at F = I the stress is 2μ ε + λ tr(ε) I. The logarithm of their eq. 14, which
/// guards an element squeezed to a point, is left out: a pose with inverted elements is refused anyway.
/// The energy is that of a material with ν = 0 and the same μ, plus λ/2 θ².
///
/// Forces f_a = −V (μ F g_a + q c_a), q = −μ + μ θ + p, p = λ θ, c_a = ∂J/∂x_a = cof(F) g_a; exact tangent
///   K_ab = V (μ (g_a·g_b) I + (μ + λ) c_a c_bᵀ + q ∂²J/∂x_a∂x_b).
/// The semidefinite one has the negative eigenvalues of the energy's 9 × 9 Hessian by F set to zero [Teran et
/// al., "Robust Quasistatic Finite Elements and Flesh Simulation", 2005], known from the singular values of F
/// [Smith et al. 2018, section 4]: it is the exact one wherever that is semidefinite element by element.
///
/// Where a patch resists the change of volume, λ is zero and the patch's pressure stands for p.
class NeoHookeanElement {
 public:
  /// @param corners  3 × 4 present positions, m
  NeoHookeanElement(const RestTetrahedron& rest, const Moduli& moduli, const Corners& corners);

  bool inverted() const { return !(J_ > 0); }  ///< turned inside out, or not finite

  double energy() const;                            ///< U, J
  double dilatation() const { return J_ - 1; }      ///< θ
  Corners dilatation_gradient() const;              ///< ∂θ/∂x_a as columns, 1/m
  Corners forces(double patch_pressure = 0) const;  ///< f_a as columns, N; of a pressure in Pa
  Blocks stiffness(Tangent tangent, double patch_pressure = 0) const;  ///< N/m

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
