// SPDX-License-Identifier: Apache-2.0
#include "tests/validation/beam.h"

#include <cmath>

#include "tests/fem/body/bodies.h"

namespace tendril::validation {

using Eigen::Vector3d;
using Eigen::VectorXd;

fem::Mesh Beam::mesh() const {
  fem::Mesh mesh = fem::testing::beam(cells_along, cells_wide, cells_high, 1);
  const Vector3d cell(length / cells_along, width / cells_wide, height / cells_high);
  mesh.nodes = cell.asDiagonal() * mesh.nodes;
  return mesh;
}

std::vector<int> Beam::clamped() const { return mesh().regions.at("base"); }

std::vector<std::pair<int, double>> Beam::end_face() const {
  std::vector<std::pair<int, double>> shares;
  const auto share = [](int i, int cells) { return (i == 0 || i == cells ? 0.5 : 1.0) / cells; };
  for (int j = 0; j <= cells_wide; ++j)
    for (int k = 0; k <= cells_high; ++k)
      shares.emplace_back(node(cells_along, j, k), share(j, cells_wide) * share(k, cells_high));
  return shares;
}

std::vector<NodalLoad> Beam::end_load(const Vector3d& force) const {
  std::vector<NodalLoad> loads;
  for (const auto& [node, share] : end_face()) loads.push_back({node, share * force});
  return loads;
}

Vector3d Beam::end_displacement(const fem::Model& model, const VectorXd& x) const {
  Vector3d mean = Vector3d::Zero();
  for (const auto& [node, share] : end_face()) mean += share * displacement(model, x, node);
  return mean;
}

double timoshenko_stiffness(const Beam& beam, const fem::Material& material) {
  const double nu = material.poisson_ratio, kappa = 10 * (1 + nu) / (12 + 11 * nu);
  const double bending = std::pow(beam.length, 3) / (3 * material.young_modulus * beam.second_moment());
  const double shear = beam.length / (kappa * material.lame_mu() * beam.area());
  return 1 / (bending + shear);
}

double end_stiffness(const Beam& beam, const fem::Material& material) {
  fem::Model model(beam.mesh(), material, fem::Mass{1}, beam.clamped(), Vector3d::Zero());
  const double force = timoshenko_stiffness(beam, material) * 1e-3 * beam.length;
  const VectorXd x = settle(model, model.rest(), beam.end_load({0, 0, -force}));
  return -force / beam.end_displacement(model, x).z();
}

}  // namespace tendril::validation
