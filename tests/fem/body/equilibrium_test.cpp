// SPDX-License-Identifier: Apache-2.0
#include "fem/body/equilibrium.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "tests/fem/body/bodies.h"
#include "tests/fem/sparse/cholmod_factor.h"

namespace tendril::fem::equilibrium_test {

/// The beam and its pose.
struct Beam : testing::Beam {
  Equilibrium body{model, constraints};

  /// Largest force out of balance on a free node's coordinate, N.
  double residual(const Eigen::VectorXd& lambda) const {
    Eigen::VectorXd f;
    model.internal_forces(body.x(), f);
    Eigen::MatrixXd J_aT(model.unknowns(), constraints.actuators());
    constraints.actuator_directions(body.x(), J_aT);
    return (f + model.external_forces() + J_aT * lambda).cwiseAbs().maxCoeff();
  }
};

TEST_CASE("At the settled pose internal, external and cable forces balance", "[law]") {
  Beam beam;
  const Eigen::Vector2d lambda(1.5, 0.2);
  const EquilibriumResult settled = beam.body.settle_under_efforts(lambda, 1e-11);
  REQUIRE(settled.converged);
  CHECK(beam.residual(lambda) < 1e-9);
}

TEST_CASE("Newton's method converges quadratically with the exact tangent", "[law]") {
  Beam beam;
  const Eigen::Vector2d lambda(0.8, 0.1);
  std::vector<double> moves;
  for (int k = 0; k < 8; ++k) {
    REQUIRE(beam.body.linearise(lambda) == LinearisationStatus::kUsable);
    moves.push_back(beam.body.advance(lambda));
  }
  // Once below 0.1 mm, each step is at most about the square of the one before (times 1000 / m, a body of
  // centimetres).
  int squared = 0;
  for (size_t k = 1; k < moves.size(); ++k)
    if (moves[k - 1] < 1e-4 && moves[k - 1] > 1e-8) {
      CHECK(moves[k] < 1000 * moves[k - 1] * moves[k - 1] + 1e-14);
      ++squared;
    }
  CHECK(squared >= 1);
}

TEST_CASE("Cables of given lengths end at these lengths with the tensions that hold them", "[law]") {
  Beam beam;
  const Eigen::Vector2d delta_a(0.004, -0.001);
  const EquilibriumResult settled = beam.body.settle_at_displacements(delta_a, EffortSign::kBilateral, 1e-11);
  REQUIRE(settled.converged);
  CHECK((beam.constraints.displacement(beam.body.x()) - delta_a).norm() < 1e-10);
  CHECK(beam.residual(settled.lambda) < 1e-9);
}

TEST_CASE("A cable that would have to push goes slack instead", "[law]") {
  Beam beam;
  const Eigen::Vector2d delta_a(0.004, -0.008);  // the lower cable is paid out further than the body needs
  const EquilibriumResult settled = beam.body.settle_at_displacements(delta_a, EffortSign::kPullOnly, 1e-11);
  REQUIRE(settled.converged);
  CHECK(settled.lambda[0] > 0);
  CHECK(settled.lambda[1] == 0);
  const Eigen::VectorXd reached = beam.constraints.displacement(beam.body.x());
  CHECK(std::abs(reached[0] - delta_a[0]) < 1e-10);
  CHECK(reached[1] > delta_a[1] + 1e-5);
}

TEST_CASE("A cantilever's small deflection follows its weight linearly", "[law]") {
  // Twice the weight, twice the deflection, while it stays small.
  Eigen::Vector2d tip;
  for (int k = 0; k < 2; ++k) {
    const Mesh mesh = testing::beam(8, 2, 2, 0.01);
    const Model model = testing::beam_model(mesh, {10e6, 0.3}, 1e-3 * (k + 1));
    const Constraints constraints = testing::beam_constraints(model, Beam::kLength, Beam::kHeight);
    Equilibrium body(model, constraints);
    REQUIRE(body.settle_under_efforts(Eigen::Vector2d::Zero(), 1e-13).converged);
    tip[k] = (constraints.effector_position(body.x()) - constraints.effector_position(model.rest()))[2];
  }
  CHECK(tip[0] < 0);
  CHECK(tip[1] / tip[0] == Approx(2).epsilon(1e-4));
}

TEST_CASE("With a factor that is reused the body comes to the same rest, and it is factored there", "[law]") {
  const testing::Beam beam;
  Equilibrium direct(beam.model, beam.constraints),
      reused(beam.model, beam.constraints, LinearSolverKind::kReused);
  const Eigen::Vector2d delta_a(0.004, -0.001);
  for (Equilibrium* body : {&direct, &reused}) {
    REQUIRE(body->settle_under_efforts(Eigen::Vector2d(1.5, 0.2), 1e-11).converged);
    REQUIRE(body->settle_at_displacements(delta_a, EffortSign::kPullOnly, 1e-11).converged);
  }
  CHECK((direct.x() - reused.x()).lpNorm<Eigen::Infinity>() < 1e-10);
  // The compliance of the last pose has no error of an iteration: it was factored.
  CHECK((direct.compliance().W_aa - reused.compliance().W_aa).norm() <
        1e-8 * direct.compliance().W_aa.norm());
}

TEST_CASE("A pose turned inside out is reported, not linearised", "[law]") {
  Beam beam;
  Eigen::VectorXd x = beam.model.rest();
  x[0] += 0.05;
  beam.body.set_x(x);
  CHECK(beam.body.linearise(Eigen::Vector2d::Zero()) == LinearisationStatus::kDiverged);
  x[0] = NAN;
  beam.body.set_x(x);
  CHECK(beam.body.linearise(Eigen::Vector2d::Zero()) == LinearisationStatus::kDiverged);
}

TEST_CASE("After a settling that failed the body does not move on from where it is", "[law]") {
  const testing::Beam beam;
  Equilibrium body(beam.model, beam.constraints);
  const Eigen::Vector2d slack(0, 0);
  REQUIRE(body.settle_under_efforts(slack, 1e-9).converged);
  const Eigen::VectorXd x = body.x();
  REQUIRE_FALSE(
      body.settle_at_displacements(Eigen::Vector2d(0.3, 0), EffortSign::kPullOnly, 1e-9, 20).converged);
  CHECK(body.advance(slack) == 0);  // what is known of the way on belongs to another pose
  CHECK(body.x() == x);
  REQUIRE(body.linearise(slack) == LinearisationStatus::kUsable);
  CHECK(body.advance(slack) < 1e-9);
}

TEST_CASE("Efforts that are not finite are refused and leave the body where it is", "[law]") {
  testing::Beam beam;
  Equilibrium body(beam.model, beam.constraints);
  REQUIRE(body.linearise(Eigen::Vector2d::Zero()) == LinearisationStatus::kUsable);
  const Eigen::VectorXd x = body.x();
  CHECK(body.linearise(Eigen::Vector2d(NAN, 0)) == LinearisationStatus::kDiverged);
  CHECK(body.advance(Eigen::Vector2d::Zero()) == 0);
  CHECK(body.x() == x);
  REQUIRE(body.linearise(Eigen::Vector2d::Zero()) == LinearisationStatus::kUsable);
  body.advance(Eigen::Vector2d(NAN, 0));
  CHECK(body.linearise(Eigen::Vector2d::Zero()) == LinearisationStatus::kUsable);
  CHECK(body.x() == x);
}

TEST_CASE("A buckled column is not called an equilibrium", "[law]") {
  // Upright and so heavy that it would fall to a side; Newton's method on the symmetric mesh may stay
  // upright.
  const Mesh mesh = testing::beam(10, 2, 2, 0.01);
  const Model model = testing::beam_model(mesh, {150e3, 0.45}, 0.5, {-testing::kGravity, 0, 0});
  const Constraints constraints(model, {}, {PointEffector{{attach(model.mesh(), {0.1, 0.01, 0.01}, 0)}}});
  Equilibrium body(model, constraints, GENERATE(LinearSolverKind::kDirect, LinearSolverKind::kReused));
  const EquilibriumResult settled = body.settle_under_efforts(Eigen::VectorXd(), 1e-9);
  if (settled.converged) {
    StiffnessMatrix K = model.make_stiffness({});
    Eigen::VectorXd f;
    Assembler(model, K).assemble(body.x(), Tangent::kExact, f, K);
    CholmodFactor factor(K);
    CHECK(factor.factorize(K));
  } else {
    CHECK(body.x() == model.rest());
  }
}

TEST_CASE("A step that turned elements inside out is halved until it did not", "[law]") {
  Beam beam;
  const Eigen::Vector2d lambda(16.0, 0.0);
  REQUIRE(beam.body.linearise(Eigen::Vector2d::Zero()) == LinearisationStatus::kUsable);
  Eigen::VectorXd f, before;
  int steps = 0;
  do {  // one straight line, far beyond what the linearisation is good for
    before = beam.body.x();
    beam.body.advance(lambda);
    REQUIRE(++steps < 100);
  } while (beam.model.internal_forces(beam.body.x(), f) == 0);
  const Eigen::VectorXd too_far = beam.body.x();
  REQUIRE(beam.body.linearise(lambda) == LinearisationStatus::kUsable);
  CHECK(beam.model.internal_forces(beam.body.x(), f) == 0);
  const double share = (beam.body.x() - before).norm() / (too_far - before).norm();
  CHECK(share > 0);
  CHECK(share < 0.5 + 1e-9);
}

}  // namespace tendril::fem::equilibrium_test
