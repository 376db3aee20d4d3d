#pragma once

namespace tendril::fem {

/// An isotropic elastic material.
struct Material {
  double young_modulus;  ///< E, Pa, > 0
  double poisson_ratio;  ///< ν, unitless, 0 ≤ ν < 0.5

  /// First Lamé parameter λ, Pa.
  double lame_lambda() const {
    return young_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio));
  }
  /// Shear modulus μ, Pa.
  double lame_mu() const { return young_modulus / (2 * (1 + poisson_ratio)); }
};

}  // namespace tendril::fem
