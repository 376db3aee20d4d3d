// SPDX-License-Identifier: Apache-2.0
#include "fem/element/patches.h"

#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <numeric>
#include <set>

#include "fem/body/assembler.h"
#include "tests/fem/body/bodies.h"
#include "tests/fem/element/elements.h"
#include "tests/fem/sparse/cholmod_factor.h"

namespace tendril::fem::patches_test {

using testing::beam;
using testing::beam_model;

bool share_a_face(const std::array<int, 4>& a, const std::array<int, 4>& b) {
  return std::count_if(a.begin(), a.end(),
                       [&](int node) { return std::find(b.begin(), b.end(), node) != b.end(); }) == 3;
}

bool connected(const Mesh& mesh, const std::vector<int>& tets) {
  std::set<int> reached{tets.front()};
  for (size_t before = 0; before != reached.size();) {
    before = reached.size();
    for (int t : tets)
      for (int s : std::set(reached))
        if (share_a_face(mesh.tets[t], mesh.tets[s])) reached.insert(t);
  }
  return reached.size() == tets.size();
}

TEST_CASE("Patches hold every tetrahedron of their groups once, are connected and neither small nor large",
          "[law]") {
  const Mesh mesh = beam(5, 3, 3, 0.01);
  std::vector<int> group(mesh.tets.size());
  for (int t = 0; t < mesh.tet_count(); ++t) group[t] = t < 90 ? 0 : t < 102 ? kNoPatch : 1;
  std::vector<int> seen(mesh.tets.size(), 0);
  const auto patches = make_patches(mesh, group);
  for (const Patch& patch : patches) {
    CHECK(patch.tets.size() >= 4);
    CHECK(patch.tets.size() <= 12);
    CHECK(connected(mesh, patch.tets));
    std::set<int> nodes;
    for (int t : patch.tets) {
      ++seen[t];
      CHECK(group[t] == group[patch.tets.front()]);
      nodes.insert(mesh.tets[t].begin(), mesh.tets[t].end());
    }
    CHECK(std::equal(nodes.begin(), nodes.end(), patch.nodes.begin(), patch.nodes.end()));
    CHECK(patch.volume == Approx(1e-6 / 6 * static_cast<double>(patch.tets.size())));
  }
  for (int t = 0; t < mesh.tet_count(); ++t) CHECK(seen[t] == (group[t] == kNoPatch ? 0 : 1));
  CHECK(std::abs(static_cast<double>(patches.size()) - (mesh.tet_count() - 12) / 8.0) < 5);
}

Eigen::MatrixXd stiffness_at_rest(const Mesh& mesh, const Material& material) {
  const Model model = beam_model(mesh, material);
  StiffnessMatrix K = model.make_stiffness({});
  Eigen::VectorXd f;
  Assembler(model, K).assemble(model.rest(), Tangent::kExact, f, K);
  return K.dense();
}

TEST_CASE(
    "Patches are softer than their elements by themselves, and stiffer than without any resistance to a "
    "change of volume",
    "[law]") {
  // Hence no deformation is free of energy, whatever pattern of growing and shrinking elements it has.
  const Mesh mesh = beam(3, 2, 2, 0.01);
  const double E = 150e3, nu = 0.495;
  const Law law = GENERATE(from_range(kLaws));
  const Eigen::MatrixXd alone = stiffness_at_rest(mesh, {E, nu, law, Dilatation::kElement});
  const Eigen::MatrixXd patches = stiffness_at_rest(mesh, {E, nu, law, Dilatation::kPatch});
  const Eigen::MatrixXd shear_only = stiffness_at_rest(mesh, {E / (1 + nu), 0, law});  // the same mu
  CHECK(testing::smallest_eigenvalue(alone - patches) > -1e-10);
  CHECK(testing::smallest_eigenvalue(patches - shear_only) > -1e-10);
  CHECK((alone - patches).norm() > 0.1 * alone.norm());
  CHECK((patches - shear_only).norm() > 0.1 * alone.norm());
}

/// Deflection of a cantilever's tip under a small load there, as a share of what Timoshenko's beam theory
/// says.
double deflection(int across, const Material& material) {
  const double length = 0.08, height = 0.02, E = material.young_modulus;
  const Mesh mesh = beam(4 * across, across, across, height / across);
  const Model model = beam_model(mesh, material);
  StiffnessMatrix K = model.make_stiffness({});
  Eigen::VectorXd f;
  Assembler(model, K).assemble(model.rest(), Tangent::kExact, f, K);
  CholmodFactor factor(K);
  REQUIRE(factor.factorize(K));
  Eigen::MatrixXd tip = Eigen::MatrixXd::Zero(model.unknowns(), 1), u;
  for (int i = 0; i < model.free_nodes(); ++i)
    if (model.rest()[3 * i] > length - 1e-6) tip(3 * i + 2, 0) = 1;
  tip /= tip.sum();
  factor.solve(tip, u);
  const double I = std::pow(height, 4) / 12, G = material.lame_mu();
  const double theory = std::pow(length, 3) / (3 * E * I) + length / (5.0 / 6 * G * height * height);
  return tip.col(0).dot(u.col(0)) / theory;
}

TEST_CASE("Nearly incompressible elements lock; in patches they bend as a compressible material does",
          "[law]") {
  const Law law = GENERATE(from_range(kLaws));
  const auto at = [&](double nu, Dilatation dilatation) {
    return deflection(4, {150e3, nu, law, dilatation});
  };
  const double compressible = at(0.3, Dilatation::kElement);
  const double alone = at(0.49, Dilatation::kElement), patches = at(0.49, Dilatation::kPatch);
  const double rubber_alone = at(0.4999, Dilatation::kElement), rubber = at(0.4999, Dilatation::kPatch);
  CAPTURE(compressible, alone, patches, rubber_alone, rubber);
  // What they all lack is the bending of a coarse mesh of linear tetrahedra, which refinement mends.
  CHECK(compressible == Approx(0.78).margin(0.03));
  CHECK(alone < 0.35);
  CHECK(rubber_alone < 0.1);
  CHECK(patches > 0.97 * compressible);
  CHECK(rubber > 0.97 * compressible);
  CHECK(patches < 1);
  CHECK(deflection(6, {150e3, 0.49, law, Dilatation::kPatch}) == Approx(0.87).margin(0.03));
}

}  // namespace tendril::fem::patches_test
