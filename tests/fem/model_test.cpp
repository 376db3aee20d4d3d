#include "fem/model.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "fem/assembler.h"
#include "fem/factor.h"
#include "tests/fem/bodies.h"

namespace tendril::fem {
namespace {

using Catch::Matchers::Contains;
using testing::beam;
using testing::beam_model;
using testing::random_vector;

TEST_CASE("Internal forces are minus the gradient of the elastic energy", "[law]") {
  const unsigned seed = GENERATE(11u, 12u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const Model model = beam_model(beam(3, 1, 1, 0.01));
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
  const Model model = beam_model(beam(3, 1, 1, 0.01));
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
  const Model model = beam_model(mesh, {150e3, 0.45}, 0.05, Eigen::Vector3d::Zero());

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
  Factor factor(K);
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
  two.nodes.rightCols(n) =
      one.nodes.colwise() + Eigen::Vector3d(0.02, 0, 0);  // touches the first, shares no node
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

}  // namespace
}  // namespace tendril::fem
