// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "tests/validation/statics.h"

namespace tendril::validation {

/// A straight beam of rectangular section along x, clamped at x = 0.
struct Beam {
  double length, height;  ///< along x and z, m
  double width = height;  ///< along y, m
  int cells_along, cells_high, cells_wide;

  fem::Mesh mesh() const;
  std::vector<int> clamped() const;
  double area() const { return width * height; }                                  ///< m²
  double second_moment() const { return width * height * height * height / 12; }  ///< m⁴, bending in z

  /// Nodes of the end face with their shares of its area, which sum to 1.
  std::vector<std::pair<int, double>> end_face() const;
  /// A force (N) spread evenly over the end face.
  std::vector<NodalLoad> end_load(const Eigen::Vector3d& force) const;
  /// Mean displacement of the end face, m.
  Eigen::Vector3d end_displacement(const fem::Model& model, const Eigen::VectorXd& x) const;
  int node(int i, int j, int k) const { return (i * (cells_wide + 1) + j) * (cells_high + 1) + k; }
};

/// Load over deflection of Timoshenko's cantilever, N/m: 1/k = L³/(3 E I) + L/(κ G A) with
/// κ = 10 (1 + ν)/(12 + 11 ν) of a rectangle [Cowper, "The shear coefficient in Timoshenko's beam theory",
/// 1966].
double timoshenko_stiffness(const Beam& beam, const fem::Material& material);

/// The same of the body, under an end load that deflects Timoshenko's beam by a thousandth of its length.
double end_stiffness(const Beam& beam, const fem::Material& material);

}  // namespace tendril::validation
