// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "fem/element/material.h"

namespace tendril::validation {

/// How a hollow sphere answers to pressure.
struct Inflation {
  std::vector<double> displacement;  ///< radial, mean of each layer of nodes, m
  double growth;                     ///< of the cavity's volume, m³
};

/// A hollow sphere, free outside, under a small pressure inside. A model must be held somewhere: a cover a
/// million times softer than the wall surrounds it, and the cover's outer nodes are fixed.
struct PressedSphere {
  static constexpr double kInner = 0.01, kOuter = 0.02;  // m, radii
  static constexpr double kPressureShare = 1e-5;         // of Young's modulus, so that it answers linearly

  fem::Material material;
  int layers;  ///< of cells through the wall; the edges of the icosahedron are cut into as many parts

  std::vector<double> radii() const;  ///< of the layers of nodes, m
  double cell() const { return (kOuter - kInner) / layers; }

  /// @throws std::runtime_error if the sphere does not come to rest
  Inflation inflate() const;

  /// Lamé's displacement u(r) = A r + B/r², m.
  double theory(double r) const;
  /// Growth of the cavity by it, 4π a² u(a), m³.
  double theory_of_growth() const;
};

}  // namespace tendril::validation
