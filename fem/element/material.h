#pragma once

namespace tendril::fem {

/// How stress follows strain; both laws agree with E and ν where strains are small.
enum class Law {
  kCorotational,  ///< linear elasticity in a frame that turns with the element, see CorotationalElement
  kNeoHookean,    ///< stable Neo-Hookean, for large strains, see NeoHookeanElement
};

/// Over what the change of volume is taken.
enum class Dilatation {
  kElement,  ///< each tetrahedron by itself: linear tetrahedra then lock as ν nears 1/2
  kPatch,    ///< the mean over a patch of tetrahedra, see Patch: for rubber that hardly changes its volume
};

/// An isotropic elastic material.
struct Material {
  double young_modulus;  ///< E, Pa, > 0
  double poisson_ratio;  ///< ν, unitless, 0 ≤ ν < 0.5
  Law law = Law::kCorotational;
  Dilatation dilatation = Dilatation::kElement;

  /// First Lamé parameter λ, Pa.
  double lame_lambda() const {
    return young_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio));
  }
  /// Shear modulus μ, Pa.
  double lame_mu() const { return young_modulus / (2 * (1 + poisson_ratio)); }
};

}  // namespace tendril::fem
