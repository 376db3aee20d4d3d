// SPDX-License-Identifier: Apache-2.0
#include "fem/body/dynamics.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "fem/body/equilibrium.h"
#include "tests/fem/body/chamber.h"

namespace tendril::fem::dynamics_test {

using testing::Beam;

TEST_CASE("Motion comes to rest at the static equilibrium", "[law]") {
  const Beam beam;
  const Eigen::Vector2d delta_a(0.004, -0.008);
  Dynamics moving(beam.model, beam.constraints, {5, 0.02});
  for (int k = 0; k < 1500; ++k) REQUIRE(moving.step(delta_a, 0.01));
  Equilibrium resting(beam.model, beam.constraints);
  const EquilibriumResult settled = resting.settle_at_displacements(delta_a, EffortSign::kPullOnly, 1e-12);
  REQUIRE(settled.converged);
  CHECK((moving.x() - resting.x()).cwiseAbs().maxCoeff() < 1e-8);
  CHECK((moving.efforts() - settled.lambda).norm() < 1e-5 * settled.lambda.norm());
}

TEST_CASE("Actuators of every kind come to rest where statics has them", "[law]") {
  const testing::Chamber chamber(0, {0, 0, -testing::kGravity});
  Eigen::VectorXd delta_a(5);
  delta_a << 0.0005, -0.001, 0.0005, 0.001, 0.1 * testing::Chamber::kVolume;  // m, m³ of the last
  Dynamics moving(chamber.model, chamber.constraints, {5, 0.02});
  for (int k = 0; k < 300; ++k) REQUIRE(moving.step(delta_a * std::min(1.0, k / 10.0), 0.01));
  Equilibrium resting(chamber.model, chamber.constraints);
  const EquilibriumResult settled = resting.settle_at_displacements(delta_a, EffortSign::kPullOnly, 1e-12);
  REQUIRE(settled.converged);
  CHECK((moving.x() - resting.x()).cwiseAbs().maxCoeff() < 1e-8);
  CHECK((moving.efforts() - settled.lambda).cwiseQuotient(settled.lambda).norm() < 1e-4);
}

TEST_CASE("A body at equilibrium stays there", "[law]") {
  const Beam beam;
  const Eigen::Vector2d delta_a(0.003, 0.0);
  Equilibrium resting(beam.model, beam.constraints);
  REQUIRE(resting.settle_at_displacements(delta_a, EffortSign::kPullOnly, 1e-13).converged);
  Dynamics moving(beam.model, beam.constraints, {0, 0});
  moving.reset(resting.x());
  for (int k = 0; k < 100; ++k) REQUIRE(moving.step(delta_a, 0.01));
  CHECK((moving.x() - resting.x()).cwiseAbs().maxCoeff() < 1e-9);
}

TEST_CASE("Free fall: without elasticity in play the centre of mass obeys Newton", "[law]") {
  // The first step from rest under gravity alone, in the limit of a short step, moves every node by g h².
  const Beam beam;
  const double h = 1e-7;
  Dynamics moving(beam.model, beam.constraints, {0, 0});
  REQUIRE(moving.step(Eigen::Vector2d::Constant(-1), h));  // cables slack
  const auto v = moving.v().reshaped(3, beam.model.free_nodes());
  for (int i = 0; i < beam.model.free_nodes(); ++i)
    CHECK(v(2, i) == Approx(-testing::kGravity * h).epsilon(1e-3));
}

TEST_CASE("A swinging body loses energy and never gains any", "[law]") {
  const Beam beam;
  const auto total = [&](const Dynamics& d) {
    return d.kinetic_energy() + beam.model.energy(d.x()) - beam.model.external_forces().dot(d.x());
  };
  const double alpha = GENERATE(0.0, 5.0);
  CAPTURE(alpha);
  Dynamics moving(beam.model, beam.constraints, {alpha, 0});
  double before = total(moving);
  const double start = before;
  for (int k = 0; k < 300; ++k) {
    REQUIRE(moving.step(Eigen::Vector2d::Constant(-1), 0.005));
    const double now = total(moving);
    CHECK(now <= before + 1e-6 * std::abs(start - before) + 1e-12);
    before = now;
  }
  CHECK(before < start);
}

TEST_CASE("One step from rest obeys backward Euler with Rayleigh damping", "[law]") {
  const unsigned seed = GENERATE(61u, 62u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const Mesh mesh = testing::beam(4, 2, 2, 0.01);
  const Model model = testing::beam_model(mesh, {150e3, 0.45}, 0.05, Eigen::Vector3d::Zero());
  const Constraints constraints(model, {}, {});
  const double h = 0.01, alpha = 3, beta = 0.02;
  Dynamics moving(model, constraints, {alpha, beta});
  const Eigen::VectorXd v = testing::random_vector(random, model.unknowns(), 0.01);
  moving.set_velocity(v);
  REQUIRE(moving.step(Eigen::VectorXd(), h));

  StiffnessMatrix K = model.make_stiffness({});
  Eigen::VectorXd f;
  Assembler(model, K).assemble(model.rest(), Tangent::kExact, f, K);
  const Eigen::VectorXd& next = moving.v();
  const Eigen::VectorXd inertia = model.masses().cwiseProduct(next - v) / h;
  const Eigen::VectorXd damping = alpha * model.masses().cwiseProduct(next) + beta * K.multiply(next);
  const Eigen::VectorXd elastic = h * K.multiply(next);
  CHECK((inertia + damping + elastic).norm() < 1e-9 * inertia.norm());
  CHECK((moving.x() - model.rest() - h * next).norm() < 1e-15);
}

TEST_CASE("A pulled cable is taut at its length at the end of every step, a paid-out one is slack", "[law]") {
  const Beam beam;
  const double h = 0.01;
  Dynamics moving(beam.model, beam.constraints, {2, 0.01});
  Eigen::Vector2d delta_a(0, -0.02);
  for (int k = 0; k < 50; ++k) {
    delta_a[0] += 1e-4;  // 10 mm/s
    REQUIRE(moving.step(delta_a, h));
    const Eigen::VectorXd reached = beam.constraints.displacement(moving.x());
    if (moving.efforts()[0] > 0) CHECK(std::abs(reached[0] - delta_a[0]) < 2e-5);  // linearised in the step
    CHECK(moving.efforts()[0] >= 0);
    CHECK(moving.efforts()[1] == 0);
    CHECK(reached[1] >= delta_a[1]);
  }
  CHECK(moving.efforts()[0] > 0.1);
}

TEST_CASE("A velocity that is not finite is refused, with no actuator to notice it", "[law]") {
  const Beam beam;
  const Constraints none(beam.model, {}, {});
  Dynamics moving(beam.model, none, {0, 0});
  moving.set_velocity(Eigen::VectorXd::Constant(beam.model.unknowns(), NAN));
  CHECK_FALSE(moving.step(Eigen::VectorXd(), 0.01));
  CHECK(moving.x() == beam.model.rest());
}

TEST_CASE("A state that cannot be advanced is refused and left as it was", "[law]") {
  const Beam beam;
  Dynamics moving(beam.model, beam.constraints, {0, 0});
  REQUIRE(moving.step(Eigen::Vector2d::Zero(), 0.01));
  Eigen::VectorXd x = moving.x();
  x[0] += 0.05;  // inside out
  const Eigen::VectorXd v = moving.v();
  moving.reset(x);
  moving.set_velocity(v);
  CHECK_FALSE(moving.step(Eigen::Vector2d::Zero(), 0.01));
  CHECK(moving.x() == x);
  CHECK(moving.v() == v);
}

}  // namespace tendril::fem::dynamics_test
