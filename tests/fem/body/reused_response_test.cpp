// SPDX-License-Identifier: Apache-2.0
#include "fem/body/reused_response.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "fem/body/equilibrium.h"
#include "rt/heap_guard.h"
#include "tests/fem/body/chamber.h"

namespace tendril::fem::reused_response_test {

using testing::random_vector;

/// A beam of some 1100 nodes on its way from rest to a bend, and its response both ways.
struct Bending {
  static constexpr double kLength = 0.2, kHeight = 0.06;  // m

  Bending() {
    Equilibrium body(model, constraints);
    if (!body.settle_under_efforts(lambda, 1e-9).converged) throw std::runtime_error("the beam is too soft");
    bent = body.x();
  }

  /// Puts the body a share of the way to its bend, with the forces and the stiffness there.
  void place(double share) {
    x = model.rest() + share * (bent - model.rest());
    efforts = share * lambda;
    assembler.assemble(x, Tangent::kExact, r, K);
    r += model.external_forces();
    constraints.add_stiffness(x, efforts, Tangent::kExact, K);
  }

  bool reuse() { return reused.compute(K, x, r, efforts); }

  /// Largest difference of the compliances, relative.
  double error() {
    REQUIRE(direct.compute(K, x, r));
    Compliance a, b;
    direct.compliance(x, a);
    reused.compliance(x, b);
    return std::max((a.W_aa - b.W_aa).norm() / a.W_aa.norm(), (a.W_ea - b.W_ea).norm() / a.W_ea.norm());
  }

  Mesh mesh = testing::beam(20, 6, 6, 0.01);
  Model model = testing::beam_model(mesh, {150e3, 0.45}, 0.1);
  Constraints constraints = testing::beam_constraints(model, kLength, kHeight);
  const Eigen::Vector2d lambda{3.0, 0.5};  // N
  StiffnessMatrix K = model.make_stiffness(constraints.cliques());
  Assembler assembler{model, K};
  Response direct{constraints, K, Border::Rows::kActuatorsAndEffectors};
  ReusedResponse reused{constraints, K};
  Eigen::VectorXd bent, x, r, efforts;
};

TEST_CASE("Along a path the reused response agrees with the direct one within its tolerance", "[law]") {
  Bending b;
  int factored = 0;
  for (int k = 0; k <= 30; ++k) {
    b.place(k / 30.0);
    REQUIRE(b.reuse());
    factored += b.reused.factored();
    CAPTURE(k, b.reused.factored(), b.reused.sweeps());
    CHECK(b.error() < (b.reused.factored() ? 1e-9 : 10 * std::pow(ReusedResponse::kTolerance, 2)));

    // The way to half of the efforts more; of what is out of balance one step is enough.
    Eigen::VectorXd expected, dx;
    b.direct.solve_step(1.5 * b.efforts, expected);
    b.reused.solve_step(1.5 * b.efforts, dx);
    CHECK((dx - expected).norm() < 0.1 * expected.norm());
  }
  CHECK(factored >= 1);
  CHECK(factored <= 15);
}

TEST_CASE("At rest under its efforts the body does not move, whether it was factored there or not", "[law]") {
  Bending b;
  b.place(0.97);
  REQUIRE(b.reuse());
  b.place(1);
  REQUIRE(b.reuse());
  REQUIRE_FALSE(b.reused.factored());
  Eigen::VectorXd dx;
  b.reused.solve_step(b.lambda, dx);
  CHECK(dx.lpNorm<Eigen::Infinity>() < 1e-8);
  Compliance c;
  b.reused.compliance(b.x, c);
  CHECK((c.W_ea * b.lambda + c.p_e_free - b.constraints.effector_position(b.x)).norm() < 1e-8);
  CHECK((c.W_aa * b.lambda + c.delta_a_free - b.constraints.displacement(b.x)).norm() < 1e-8);
}

TEST_CASE("A factor serves a body that has turned as a whole as it served before", "[law]") {
  Bending b;
  b.place(0);
  REQUIRE(b.reuse());
  REQUIRE(b.reused.factored());
  const Eigen::Matrix3d Q = Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  for (int slot = 0; slot < static_cast<int>(b.K.rows().size()); ++slot) {
    Eigen::Map<Eigen::Matrix3d> block(b.K.block(slot));
    block = (Q * block * Q.transpose()).eval();
  }
  for (Eigen::VectorXd* v : {&b.x, &b.r}) *v = (Q * v->reshaped(3, b.model.free_nodes())).reshaped().eval();
  REQUIRE(b.reuse());
  CHECK_FALSE(b.reused.factored());
  CHECK(b.reused.sweeps() <= 2);  // the directions of cables and effectors have not turned along
  CHECK(b.error() < 1e-6);
}

TEST_CASE("More actuators and effectors than are solved for at once are answered all the same", "[law]") {
  const testing::Chamber chamber;  // nine rows: eight and one
  StiffnessMatrix K = chamber.model.make_stiffness(chamber.constraints.cliques());
  Assembler assembler(chamber.model, K);
  ReusedResponse reused(chamber.constraints, K);
  Response direct(chamber.constraints, K, Border::Rows::kActuatorsAndEffectors);
  const Eigen::VectorXd efforts = Eigen::VectorXd::Constant(chamber.constraints.actuators(), 0.1);
  Eigen::VectorXd r, expected, dx;
  Compliance a, b;
  for (const double growth : {1.0, 1.001}) {
    const Eigen::VectorXd x = growth * chamber.model.rest();
    assembler.assemble(x, Tangent::kExact, r, K);
    REQUIRE(reused.compute(K, x, r, efforts));
    REQUIRE(direct.compute(K, x, r));
    direct.compliance(x, a);
    reused.compliance(x, b);
    CHECK(reused.factored() == (growth == 1));
    CHECK((a.W_aa - b.W_aa).norm() < 1e-3 * a.W_aa.norm());
    CHECK((a.W_ea - b.W_ea).norm() < 1e-3 * a.W_ea.norm());
    direct.solve_step(2 * efforts, expected);
    reused.solve_step(2 * efforts, dx);
    CHECK((dx - expected).norm() < 0.1 * expected.norm());
  }
}

TEST_CASE("Where the factor is of no use any more the stiffness is factored anew", "[law]") {
  const unsigned seed = 2;
  std::mt19937 random(seed);
  CAPTURE(seed);
  Bending b;
  b.place(0);
  REQUIRE(b.reuse());
  Eigen::VectorXd stiff = Eigen::VectorXd::Zero(b.K.size());
  for (double& s : stiff) s = std::pow(10.0, random_vector(random, 1, 5)[0]);
  b.K.add_diagonal(stiff);
  REQUIRE(b.reuse());
  CHECK(b.reused.factored());
  CHECK(b.error() < 1e-9);
}

TEST_CASE("A stiffness that is not positive definite is found by the steps, and a good one serves again",
          "[law]") {
  Bending b;
  b.place(0);
  REQUIRE(b.reuse());
  const double bad = GENERATE(-1e9, static_cast<double>(NAN), static_cast<double>(INFINITY));
  CAPTURE(bad);
  b.K.add_diagonal(Eigen::VectorXd::Constant(b.K.size(), bad));
  CHECK_FALSE(b.reuse());
  b.place(0);
  REQUIRE(b.reuse());
  CHECK(b.reused.factored());
  CHECK(b.error() < 1e-9);
}

TEST_CASE("After the first pose no response allocates, factored or not", "[rt]") {
  if (!rt::HeapGuard::available()) {
    WARN("skipped: heap calls are not counted in this build");
    return;
  }
  Bending b;
  Compliance c;
  Eigen::VectorXd dx;
  bool good = true;
  int factored = 0;
  int64_t calls = 0;
  for (int k = 0; k < 6; ++k) {
    b.place(0.02 * k);
    if (k == 4) b.reused.discard_factor();
    const rt::HeapGuard heap;
    good = b.reuse() && good;
    b.reused.compliance(b.x, c);
    b.reused.solve_step(b.efforts, dx);
    if (k > 0) calls += heap.calls();
    if (k > 0) factored += b.reused.factored();
  }
  CHECK(good);
  CHECK(calls == 0);
  CHECK(factored > 0);
  CHECK(factored < 5);
}

}  // namespace tendril::fem::reused_response_test
