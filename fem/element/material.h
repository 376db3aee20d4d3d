// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "fem/element/law.h"

namespace tendril::fem {

/// Over what the change of volume is averaged.
enum class Dilatation {
  kElement,  ///< each tetrahedron by itself; linear tetrahedra then lock as ν nears 1/2
  kPatch,    ///< a patch of tetrahedra, see Patch; for nearly incompressible materials
};

/// An isotropic elastic material.
struct Material {
  double young_modulus;  ///< E, Pa, > 0
  double poisson_ratio;  ///< ν, unitless, 0 ≤ ν < 0.5
  Law law = Law::of<CorotationalElement>();
  Dilatation dilatation = Dilatation::kElement;

  /// First Lamé parameter λ, Pa.
  double lame_lambda() const {
    return young_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio));
  }
  /// Shear modulus μ, Pa.
  double lame_mu() const { return young_modulus / (2 * (1 + poisson_ratio)); }
};

}  // namespace tendril::fem
