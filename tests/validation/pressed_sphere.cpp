// SPDX-License-Identifier: Apache-2.0
#include "tests/validation/pressed_sphere.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "fem/body/equilibrium.h"
#include "fem/mesh/surface.h"
#include "tests/validation/hollow_sphere.h"
#include "tests/validation/statics.h"

namespace tendril::validation {

std::vector<double> PressedSphere::radii() const {
  std::vector<double> radii;
  for (int k = 0; k <= layers; ++k) radii.push_back(kInner + k * cell());
  return radii;
}

// From σ_rr(a) = −p and σ_rr(b) = 0 with σ_rr = E/(1 − 2ν) A − 4 μ B/r³.
double PressedSphere::theory(double r) const {
  const double a3 = std::pow(kInner, 3), b3 = std::pow(kOuter, 3);
  const double share = kPressureShare * material.young_modulus * a3 / (b3 - a3);
  const double A = share * (1 - 2 * material.poisson_ratio) / material.young_modulus;
  const double B = share * b3 / (4 * material.lame_mu());
  return A * r + B / (r * r);
}

double PressedSphere::theory_of_growth() const {
  return 4 * std::numbers::pi * kInner * kInner * theory(kInner);
}

Inflation PressedSphere::inflate() const {
  std::vector<double> with_cover = radii();
  with_cover.push_back(1.25 * kOuter);
  const HollowSphere sphere = hollow_sphere(with_cover, layers);
  const fem::Mesh& mesh = sphere.mesh;
  std::vector<int> fixed(sphere.nodes_a_layer), inside(sphere.nodes_a_layer),
      material_of_tet(mesh.tet_count(), 0);
  std::iota(fixed.begin(), fixed.end(), mesh.node_count() - sphere.nodes_a_layer);
  std::fill_n(material_of_tet.rbegin(), 3 * sphere.triangles.size(), 1);  // the cover's
  const fem::Material soft{1e-6 * material.young_modulus, 0};
  const fem::Model model(mesh, {material, soft}, material_of_tet, fem::Mass{1}, fixed,
                         Eigen::Vector3d::Zero());

  for (int s = 0; s < sphere.nodes_a_layer; ++s) inside[s] = model.numbering()[s];
  const fem::Constraints pressed(model, {fem::Pressure{fem::closed_surface(model.mesh(), inside)}}, {});
  fem::Equilibrium body(model, pressed);
  const Eigen::VectorXd pressure = Eigen::VectorXd::Constant(1, kPressureShare * material.young_modulus);
  if (!body.settle_under_efforts(pressure, 1e-9 * kOuter).converged)
    throw std::runtime_error("the sphere did not come to rest under its pressure");

  Inflation result{std::vector<double>(radii().size(), 0.0), pressed.displacement(body.x())[0]};
  for (size_t layer = 0; layer < result.displacement.size(); ++layer)
    for (int s = 0; s < sphere.nodes_a_layer; ++s) {
      const int node = static_cast<int>(layer) * sphere.nodes_a_layer + s;
      const double outward = displacement(model, body.x(), node).dot(mesh.nodes.col(node).normalized());
      result.displacement[layer] += outward / sphere.nodes_a_layer;
    }
  return result;
}

}  // namespace tendril::validation
