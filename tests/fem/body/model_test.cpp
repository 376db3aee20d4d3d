// SPDX-License-Identifier: Apache-2.0
#include "fem/body/model.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <map>

#include "fem/body/assembler.h"
#include "tests/fem/body/bodies.h"
#include "tests/fem/sparse/cholmod_factor.h"

namespace tendril::fem::model_test {

using Catch::Matchers::Contains;
using testing::beam;
using testing::beam_model;
using testing::random_vector;

std::vector<Material> every_kind_of_rubber() {
  std::vector<Material> all;
  for (const Law law : kLaws)
    for (const Dilatation dilatation : {Dilatation::kElement, Dilatation::kPatch})
      all.push_back({150e3, 0.45, law, dilatation});
  return all;
}

TEST_CASE("Internal forces are minus the gradient of the elastic energy", "[law]") {
  const unsigned seed = GENERATE(11u, 12u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const Model model = beam_model(beam(3, 1, 1, 0.01), GENERATE(from_range(every_kind_of_rubber())));
  const Eigen::VectorXd x = model.rest() + random_vector(random, model.unknowns(), 1e-3);
  Eigen::VectorXd f;
  REQUIRE(model.internal_forces(x, f) == 0);
  for (int k = 0; k < 20; ++k) {
    const Eigen::VectorXd direction = random_vector(random, model.unknowns(), 1).normalized();
    const double h = 1e-7;
    const double slope = (model.energy(x + h * direction) - model.energy(x - h * direction)) / (2 * h);
    CHECK(std::abs(slope + f.dot(direction)) < 1e-6 * f.norm());
  }
}

TEST_CASE("The assembled exact tangent is minus the derivative of the internal forces", "[law]") {
  const unsigned seed = GENERATE(21u, 22u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const Model model = beam_model(beam(3, 1, 1, 0.01), GENERATE(from_range(every_kind_of_rubber())));
  StiffnessMatrix K = model.make_stiffness({});
  Assembler assembler(model, K);
  const Eigen::VectorXd x = model.rest() + random_vector(random, model.unknowns(), 1e-3);
  Eigen::VectorXd f, plus, minus;
  REQUIRE(assembler.assemble(x, Tangent::kExact, f, K) == 0);
  const Eigen::MatrixXd dense = K.dense();
  const double h = 1e-7;
  Eigen::MatrixXd numeric(model.unknowns(), model.unknowns());
  for (int j = 0; j < model.unknowns(); ++j) {
    const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(model.unknowns(), j);
    model.internal_forces(x + step, plus);
    model.internal_forces(x - step, minus);
    numeric.col(j) = -(plus - minus) / (2 * h);
  }
  CHECK((dense - numeric).norm() < 1e-7 * dense.norm());
}

TEST_CASE("A rigid motion of the whole body gives no internal force", "[law]") {
  const Mesh mesh = beam(3, 2, 1, 0.01);
  const Model model = beam_model(mesh);
  // The fixed nodes stay behind, so only nodes that share no element with them count.
  const Eigen::Matrix3d R = Eigen::AngleAxisd(1.3, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  Eigen::VectorXd x = (R * model.rest().reshaped(3, model.free_nodes())).reshaped();
  Eigen::VectorXd f;
  model.internal_forces(x, f);
  const double scale = 150e3 * 0.01 * 0.01;
  for (int i = 0; i < model.free_nodes(); ++i)
    if (model.rest()[3 * i] > 0.015) CHECK(f.segment<3>(3 * i).norm() < 1e-12 * scale);
}

TEST_CASE("Patch test: with a uniform gradient on the surface, the inside of an irregular mesh follows it",
          "[law]") {
  const unsigned seed = GENERATE(31u, 32u, 33u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const double side = 0.04;
  Mesh mesh = beam(4, 4, 4, side / 4);
  std::vector<char> inside(mesh.node_count(), 0);
  for (int i = 0; i < mesh.node_count(); ++i) {
    const Eigen::Array3d p = mesh.nodes.col(i) / side;
    inside[i] = (p > 1e-9).all() && (p < 1 - 1e-9).all();
    if (inside[i]) mesh.nodes.col(i) += random_vector(random, 3, 1.5e-3);
  }
  const Material rubber = GENERATE(from_range(every_kind_of_rubber()));
  const Model model = beam_model(mesh, rubber, 0.05, Eigen::Vector3d::Zero());

  // The face x = 0 is fixed, so the gradient is one that leaves it alone: u = x a, stretch and shear.
  const Eigen::Vector3d a(0.10, 0.05, -0.04);
  Eigen::VectorXd x = model.rest(), expected = model.rest();
  std::vector<int> unknown;
  for (int i = 0; i < mesh.node_count(); ++i) {
    const int n = model.numbering()[i];
    if (n >= model.free_nodes()) continue;
    expected.segment<3>(3 * n) += mesh.nodes(0, i) * a;
    if (!inside[i]) x.segment<3>(3 * n) = expected.segment<3>(3 * n);
    for (int c = 0; inside[i] && c < 3; ++c) unknown.push_back(3 * n + c);
  }
  REQUIRE(unknown.size() == 81);

  // Newton's method on the inner nodes alone.
  StiffnessMatrix K = model.make_stiffness({});
  Assembler assembler(model, K);
  Eigen::VectorXd f;
  for (int k = 0; k < 10; ++k) {
    REQUIRE(assembler.assemble(x, Tangent::kExact, f, K) == 0);
    const Eigen::MatrixXd inner = K.dense()(unknown, unknown);
    const Eigen::VectorXd dx = inner.ldlt().solve(f(unknown));
    for (size_t j = 0; j < unknown.size(); ++j) x[unknown[j]] += dx[static_cast<Eigen::Index>(j)];
  }
  CHECK((x - expected).cwiseAbs().maxCoeff() < 1e-12);
}

TEST_CASE("Masses add up to the body's and gravity to its weight", "[law]") {
  const Mesh mesh = beam(3, 1, 1, 0.01);
  for (const bool per_node : {false, true}) {
    const Model model(mesh, {150e3, 0.45}, Mass{0.7, per_node}, mesh.regions.at("base"), {0, 1, -9.81});
    const double free_mass = model.masses().sum() / 3;
    CHECK(free_mass < 0.7);
    if (!per_node) {
      // Cubes of equal size: a node has the mass of the quarters of its tetrahedra.
      Eigen::VectorXd quarters = Eigen::VectorXd::Zero(mesh.node_count());
      for (const auto& tet : mesh.tets)
        for (int node : tet) quarters[node] += 0.7 / mesh.tet_count() / 4;
      for (int i = 0; i < mesh.node_count(); ++i)
        if (const int n = model.numbering()[i]; n < model.free_nodes())
          CHECK(model.masses()[3 * n] == Approx(quarters[i]));
    }
    if (per_node) CHECK(free_mass == Approx(0.7 * model.free_nodes() / mesh.node_count()));
    const Eigen::Vector3d weight = model.external_forces().reshaped(3, model.free_nodes()).rowwise().sum();
    CHECK((weight - free_mass * Eigen::Vector3d(0, 1, -9.81)).norm() < 1e-12);
  }
}

TEST_CASE("A part weighs what it is given, and the others share the rest by volume", "[law]") {
  Mesh mesh = beam(4, 1, 1, 0.01);
  for (int i = 0; i < mesh.node_count(); ++i)
    if (mesh.nodes(0, i) > 0.035) mesh.nodes(0, i) = 0.05;  // the last cube becomes two long
  std::vector<int> material_of_tet(mesh.tets.size());
  for (int t = 0; t < mesh.tet_count(); ++t) material_of_tet[t] = std::min(t / 6, 2);
  const bool per_node = GENERATE(false, true);
  const Mass mass{1.0, per_node, {std::nullopt, 0.4, std::nullopt}};
  const Model model(mesh, std::vector<Material>(3, {150e3, 0.45}), material_of_tet, mass,
                    mesh.regions.at("base"), {0, 0, -9.81});

  // Layers of four nodes at x = 0 (fixed), 1, 2, 3 and 5 cm. By volume the pieces weigh 0.15, 0.4, 0.15, 0.3
  // kg and each gives half to either of its layers. Node by node all five layers share 0.6 kg, and two the
  // 0.4 kg.
  const std::map<long, double> expected =
      per_node ? std::map<long, double>{{1, 0.12 + 0.2}, {2, 0.12 + 0.2}, {3, 0.12}, {5, 0.12}}
               : std::map<long, double>{{1, 0.275}, {2, 0.275}, {3, 0.225}, {5, 0.15}};
  std::map<long, double> found;
  for (int i = 0; i < model.free_nodes(); ++i)
    found[std::lround(model.rest()[3 * i] / 0.01)] += model.masses()[3 * i];
  REQUIRE(found.size() == expected.size());
  for (const auto& [layer, kilograms] : expected) CHECK(found[layer] == Approx(kilograms));
}

TEST_CASE("A bar of two rubbers in series stretches each by its own modulus", "[law]") {
  const Mesh mesh = beam(6, 1, 1, 0.01);
  const double stiff = 300e3, soft = 100e3, stress = 100;  // Pa
  std::vector<int> material_of_tet(mesh.tets.size());
  for (int t = 0; t < mesh.tet_count(); ++t) material_of_tet[t] = t / 6 < 3 ? 0 : 1;
  // Without Poisson's effect the bar is strained evenly, and u = x stress / E solves its equations exactly.
  const Law law = GENERATE(from_range(kLaws));
  const Model model(mesh, {{stiff, 0, law}, {soft, 0, law}}, material_of_tet, Mass{0.1},
                    mesh.regions.at("base"), Eigen::Vector3d::Zero());
  StiffnessMatrix K = model.make_stiffness({});
  Eigen::VectorXd f, u = Eigen::VectorXd::Zero(model.unknowns());
  Assembler(model, K).assemble(model.rest(), Tangent::kExact, f, K);
  for (int i = 0; i < model.free_nodes(); ++i) {
    const double x = model.rest()[3 * i];
    u[3 * i] = stress * (std::min(x, 0.03) / stiff + std::max(x - 0.03, 0.0) / soft);
  }
  const Eigen::VectorXd forces = K.multiply(u);
  double pull = 0;
  for (int i = 0; i < model.free_nodes(); ++i) {
    const bool end = model.rest()[3 * i] > 0.0599;
    if (end) pull += forces[3 * i];
    if (!end) CHECK(forces.segment<3>(3 * i).norm() < 1e-12 * stress * 1e-4);
  }
  CHECK(pull == Approx(stress * 1e-4));
}

TEST_CASE("A load is shared by the corners around its point", "[law]") {
  Model model = beam_model(beam(3, 1, 1, 0.01), {150e3, 0.45}, 0.05, Eigen::Vector3d::Zero());
  const Eigen::Vector3d point(0.025, 0.004, 0.006), force(1, -2, 3);
  model.add_load(attach(model.mesh(), point, 0), force);
  const auto forces = model.external_forces().reshaped(3, model.free_nodes());
  CHECK((forces.rowwise().sum() - force).norm() < 1e-15);
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (int i = 0; i < model.free_nodes(); ++i)
    moment += Eigen::Vector3d(model.rest().segment<3>(3 * i)).cross(Eigen::Vector3d(forces.col(i)));
  CHECK((moment - point.cross(force)).norm() < 1e-15);
}

TEST_CASE("The sparse factor solves as a dense one and reports an indefinite matrix", "[law]") {
  std::mt19937 random(41);
  const Model model = beam_model(beam(3, 2, 2, 0.01));
  StiffnessMatrix K = model.make_stiffness({});
  Assembler assembler(model, K);
  Eigen::VectorXd f;
  assembler.assemble(model.rest(), Tangent::kExact, f, K);
  CholmodFactor factor(K);
  REQUIRE(factor.factorize(K));
  const Eigen::MatrixXd B = random_vector(random, 2 * model.unknowns(), 1).reshaped(model.unknowns(), 2);
  Eigen::MatrixXd X;
  factor.solve(B, X);
  CHECK((K.dense() * X - B).norm() < 1e-10 * B.norm());
  CHECK((K.multiply(X.col(0)) - B.col(0)).norm() < 1e-10 * B.col(0).norm());

  const StiffnessMatrix good = K;
  K.block(0)[5] = NAN;
  CHECK_FALSE(factor.factorize(K));
  K = good;
  K.add_diagonal(Eigen::VectorXd::Constant(model.unknowns(), -1e4));
  CHECK_FALSE(factor.factorize(K));
  REQUIRE(factor.factorize(good));  // and recovers
  factor.solve(B, X);
  CHECK((good.dense() * X - B).norm() < 1e-10 * B.norm());
}

TEST_CASE("A body that falls into parts is refused unless every part is held", "[unit]") {
  const Mesh one = beam(2, 1, 1, 0.01);
  Mesh two = one;
  const int n = one.node_count();
  two.nodes.conservativeResize(Eigen::NoChange, 2 * n);
  two.nodes.rightCols(n) = one.nodes.colwise() + Eigen::Vector3d(0.021, 0, 0);  // 1 mm apart
  for (auto tet : one.tets) {
    for (int& node : tet) node += n;
    two.tets.push_back(tet);
  }
  std::vector<int> fixed = one.regions.at("base");
  const auto build = [&] { const Model model(two, {150e3, 0.45}, Mass{0.1}, fixed, {0, 0, -9.81}); };
  CHECK_THROWS_WITH(build(), Contains("0 nodes are fixed") && Contains("falls into 2 parts"));
  for (int node : one.regions.at("base")) fixed.push_back(node + n);
  CHECK_NOTHROW(build());
}

TEST_CASE("A body that cannot be modelled is refused", "[unit]") {
  const Mesh mesh = beam(2, 1, 1, 0.01);
  const auto& base = mesh.regions.at("base");
  const Eigen::Vector3d g(0, 0, -9.81);
  const auto build = [&](Material material, double mass, std::vector<int> fixed) {
    const Model model(mesh, material, Mass{mass}, fixed, g);
  };
  CHECK_THROWS_WITH(build({-150e3, 0.45}, 0.1, base), Contains("Young's modulus is -150000"));
  CHECK_THROWS_WITH(build({NAN, 0.45}, 0.1, base), Contains("Young's modulus is nan"));
  CHECK_THROWS_WITH(build({150e3, 0.5}, 0.1, base), Contains("Poisson's ratio is 0.5"));
  CHECK_THROWS_WITH(build({150e3, 0.45}, 0, base), Contains("mass is 0"));
  CHECK_THROWS_WITH(build({150e3, 0.45}, 0.1, {}), Contains("0 nodes are fixed"));
  CHECK_THROWS_WITH(build({150e3, 0.45}, 0.1, {0, 4, 8}), Contains("do not lie on one line"));
  CHECK_THROWS_WITH(build({150e3, 0.45}, 0.1, {0, 1, 999}), Contains("fixed node 999"));
}

TEST_CASE("Of several materials the one that is wrong is named", "[unit]") {
  const Mesh mesh = beam(2, 1, 1, 0.01);  // 12 tetrahedra
  const Material good{150e3, 0.45};
  const std::vector<int> halves{0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1};
  const auto build = [&](std::vector<Material> materials, std::vector<int> of_tet, Mass mass) {
    const Model model(mesh, materials, of_tet, mass, mesh.regions.at("base"), {0, 0, -9.81});
  };
  CHECK_NOTHROW(build({good, good}, halves, {1}));
  CHECK_THROWS_WITH(build({good, {0, 0.45}}, halves, {1}), Contains("material 1: Young's modulus is 0"));
  CHECK_THROWS_WITH(build({{1e5, -0.1}, good}, halves, {1}), Contains("material 0: Poisson's ratio is -0.1"));
  CHECK_THROWS_WITH(build({good, good}, {0, 1}, {1}),
                    Contains("2 tetrahedra") && Contains("the mesh has 12"));
  CHECK_THROWS_WITH(build({good}, halves, {1}), Contains("tetrahedron 6 is of material 1, expected 0..0"));
  CHECK_THROWS_WITH(build({good, good}, halves, {1, false, {0.5}}), Contains("listed for 1 materials"));
  CHECK_THROWS_WITH(build({good, good}, halves, {1, false, {{}, -0.5}}),
                    Contains("material 1: the mass is -0.5"));
  CHECK_THROWS_WITH(build({good, good}, halves, {1, false, {1.0, {}}}), Contains("weigh 1 kg together"));
  CHECK_THROWS_WITH(build({good, good}, halves, {1, false, {0.3, 0.6}}),
                    Contains("expected the body's 1 kg"));
  CHECK_NOTHROW(build({good, good}, halves, {1, false, {0.3, 0.7}}));
  CHECK_THROWS_WITH(build({good, good, good}, halves, {1, false, {{}, {}, 0.2}}),
                    Contains("material 2: it has a mass but no tetrahedron"));
}

}  // namespace tendril::fem::model_test
