// SPDX-License-Identifier: Apache-2.0
#include "fem/body/compliance.h"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>

#include "fem/body/equilibrium.h"
#include "tests/fem/body/chamber.h"

namespace tendril::fem::compliance_test {

using testing::Beam;

TEST_CASE("W_aa is symmetric and positive semidefinite", "[law]") {
  const Beam beam;
  Equilibrium body(beam.model, beam.constraints);
  const Eigen::Vector2d lambda(1.0, 0.2);
  REQUIRE(body.settle_under_efforts(lambda, 1e-10).converged);
  REQUIRE(body.linearise(lambda) == LinearisationStatus::kUsable);
  const Eigen::MatrixXd& W = body.compliance().W_aa;
  CHECK(W == W.transpose());
  // J K⁻¹ Jᵀ with a dense inverse.
  StiffnessMatrix K = beam.model.make_stiffness(beam.constraints.cliques());
  Eigen::VectorXd f;
  Assembler(beam.model, K).assemble(body.x(), Tangent::kExact, f, K);
  beam.constraints.add_stiffness(body.x(), lambda, Tangent::kExact, K);
  Eigen::MatrixXd J_aT(beam.model.unknowns(), 2);
  beam.constraints.actuator_directions(body.x(), J_aT);
  const Eigen::MatrixXd dense = J_aT.transpose() * K.dense().ldlt().solve(J_aT);
  CHECK((W - dense).norm() < 1e-9 * dense.norm());
  CHECK(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(W).eigenvalues()[0] > 0);
}

TEST_CASE("W is what equilibrium found anew under perturbed efforts shows", "[law]") {
  const Beam beam;
  const Eigen::Vector2d lambda(1.2, 0.3);
  Equilibrium body(beam.model, beam.constraints);
  REQUIRE(body.settle_under_efforts(lambda, 1e-12).converged);
  REQUIRE(body.linearise(lambda) == LinearisationStatus::kUsable);
  const Compliance W = body.compliance();
  const double h = 1e-4;  // N
  for (int a = 0; a < 2; ++a) {
    Eigen::VectorXd p[2], delta[2];
    for (int side = 0; side < 2; ++side) {
      Equilibrium other(beam.model, beam.constraints);
      other.set_x(body.x());
      REQUIRE(
          other.settle_under_efforts(lambda + (side ? h : -h) * Eigen::Vector2d::Unit(a), 1e-13).converged);
      p[side] = beam.constraints.effector_position(other.x());
      delta[side] = beam.constraints.displacement(other.x());
    }
    const Eigen::VectorXd column_ea = (p[1] - p[0]) / (2 * h), column_aa = (delta[1] - delta[0]) / (2 * h);
    CHECK((W.W_ea.col(a) - column_ea).norm() < 1e-5 * column_ea.norm());
    CHECK((W.W_aa.col(a) - column_aa).norm() < 1e-5 * column_aa.norm());
  }
}

TEST_CASE("At equilibrium the linear law returns the present position and shortening", "[law]") {
  const Beam beam;
  const Eigen::Vector2d lambda(1.2, 0.3);
  Equilibrium body(beam.model, beam.constraints);
  REQUIRE(body.settle_under_efforts(lambda, 1e-12).converged);
  REQUIRE(body.linearise(lambda) == LinearisationStatus::kUsable);
  const Compliance& c = body.compliance();
  CHECK((c.W_ea * lambda + c.p_e_free - beam.constraints.effector_position(body.x())).norm() < 1e-10);
  CHECK((c.W_aa * lambda + c.delta_a_free - beam.constraints.displacement(body.x())).norm() < 1e-10);
}

TEST_CASE("A cavity has one compliance, seen as actuator and as effector", "[law]") {
  const testing::Chamber chamber;
  Equilibrium body(chamber.model, chamber.constraints);
  Eigen::VectorXd lambda(5);
  lambda << 0.5, -0.2, 0.3, 0.1, 5e3;  // N, Pa of the last
  REQUIRE(body.settle_under_efforts(lambda, 1e-11).converged);
  REQUIRE(body.linearise(lambda) == LinearisationStatus::kUsable);
  const Compliance& c = body.compliance();
  const auto row = c.W_aa.row(testing::Chamber::kPressure);
  CHECK((c.W_ea.row(2) - row).norm() < 1e-9 * row.norm());
  CHECK(c.p_e_free[2] - testing::Chamber::kVolume == Approx(c.delta_a_free[testing::Chamber::kPressure]));
}

}  // namespace tendril::fem::compliance_test
