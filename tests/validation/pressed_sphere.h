#pragma once

#include <vector>

#include "fem/material.h"

namespace tendril::validation {

/// A hollow sphere, free outside, under a small pressure inside. A model must be held somewhere: a cover a
/// million times softer than the wall surrounds it, and the cover's outer nodes are fixed.
struct PressedSphere {
  static constexpr double kInner = 0.01, kOuter = 0.02;  // m, radii
  static constexpr double kPressureShare = 1e-5;         // of Young's modulus, so that it answers linearly

  fem::Material material;
  int layers;  ///< of cells through the wall; the edges of the icosahedron are cut into as many parts

  std::vector<double> radii() const;  ///< of the layers of nodes, m
  double cell() const { return (kOuter - kInner) / layers; }

  /// Mean radial displacement of each layer of nodes, m.
  std::vector<double> displacements() const;

  /// Lamé's, u(r) = A r + B/r², m.
  double theory(double r) const;
  /// How much too stiff the sphere is, by the displacement inside: pressure over displacement against
  /// theory's, %.
  double error() const { return 100 * (theory(kInner) / displacements()[0] - 1); }
};

}  // namespace tendril::validation
