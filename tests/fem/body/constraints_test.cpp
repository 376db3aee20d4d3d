// SPDX-License-Identifier: Apache-2.0
#include "fem/body/constraints.h"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>

#include "fem/body/equilibrium.h"
#include "tests/fem/body/chamber.h"
#include "tests/fem/sparse/cholmod_factor.h"

namespace tendril::fem::constraints_test {

using Catch::Matchers::Contains;
using testing::Chamber;
using testing::random_vector;

constexpr double kStep = 1e-7;  // m, of differences

/// A chamber in a random pose.
struct Posed : Chamber {
  Posed(unsigned seed, double held) : Chamber(held), random(seed) {
    x = model.rest() + random_vector(random, model.unknowns(), 1e-3);
  }
  Eigen::VectorXd random_move() { return random_vector(random, model.unknowns(), 1); }

  std::mt19937 random;
  Eigen::VectorXd x;
};

TEST_CASE("Rows of J are the derivatives of what actuators and effectors measure", "[law]") {
  const unsigned seed = GENERATE(51u, 52u, 53u);
  const double held = GENERATE(0.0, 0.005);  // m; the second holds a part of the cavity's wall
  CAPTURE(seed, held);
  Posed chamber(seed, held);
  const Constraints& c = chamber.constraints;
  Eigen::MatrixXd J_aT(chamber.model.unknowns(), c.actuators());
  Eigen::MatrixXd J_eT(chamber.model.unknowns(), c.effector_coordinates());
  REQUIRE(c.actuators() == Chamber::kActuators);
  REQUIRE(c.effector_coordinates() == 3);
  c.actuator_directions(chamber.x, J_aT);
  c.effector_directions(chamber.x, J_eT);
  const Eigen::VectorXd d = chamber.random_move(), forth = chamber.x + kStep * d,
                        back = chamber.x - kStep * d;
  const Eigen::VectorXd slope_a = (c.displacement(forth) - c.displacement(back)) / (2 * kStep);
  const Eigen::VectorXd slope_e = (c.effector_position(forth) - c.effector_position(back)) / (2 * kStep);
  for (int a = 0; a < c.actuators(); ++a) {
    CAPTURE(a);
    CHECK(J_aT.col(a).dot(d) == Approx(slope_a[a]).epsilon(1e-6));
  }
  for (int r = 0; r < c.effector_coordinates(); ++r) {
    CAPTURE(r);
    CHECK(J_eT.col(r).dot(d) == Approx(slope_e[r]).epsilon(1e-6));
  }
}

TEST_CASE("The stiffness that an effort lends is the derivative of its forces", "[law]") {
  const unsigned seed = GENERATE(54u, 55u);
  const double held = GENERATE(0.0, 0.005);
  CAPTURE(seed, held);
  Posed chamber(seed, held);
  const Constraints& c = chamber.constraints;
  StiffnessMatrix K = chamber.model.make_stiffness(c.cliques());
  Eigen::MatrixXd forth(chamber.model.unknowns(), c.actuators()), back = forth;
  const Eigen::VectorXd d = chamber.random_move();
  c.actuator_directions(chamber.x + kStep * d, forth);
  c.actuator_directions(chamber.x - kStep * d, back);
  for (int a = 0; a < c.actuators(); ++a)
    for (double effort : {2.0, -0.7}) {
      CAPTURE(a, effort);
      K.set_zero();
      c.add_stiffness(chamber.x, effort * Eigen::VectorXd::Unit(c.actuators(), a), Tangent::kExact, K);
      const Eigen::VectorXd slope = -effort * (forth - back).col(a) / (2 * kStep);
      CHECK((K.multiply(d) - slope).norm() <= 1e-6 * slope.norm());
      CHECK((slope.norm() > 0) == (a != Chamber::kForce));
    }
}

TEST_CASE("What is added for a semidefinite tangent is semidefinite, and exact for what pulls", "[law]") {
  Posed chamber(56, 0);
  const Constraints& c = chamber.constraints;
  const auto stiffness = [&](const Eigen::VectorXd& lambda, Tangent tangent) {
    StiffnessMatrix K = chamber.model.make_stiffness(c.cliques());
    c.add_stiffness(chamber.x, lambda, tangent, K);
    return K.dense();
  };
  Eigen::VectorXd pulling = Eigen::VectorXd::Zero(c.actuators());
  pulling[Chamber::kCable] = 2;
  pulling[Chamber::kRodToGuide] = pulling[Chamber::kRodInside] = -3;
  CHECK(stiffness(pulling, Tangent::kSemidefinite) == stiffness(pulling, Tangent::kExact));
  CHECK(stiffness(-pulling, Tangent::kSemidefinite).norm() == 0);
  const Eigen::VectorXd pressed = 1e3 * Eigen::VectorXd::Unit(c.actuators(), Chamber::kPressure);
  CHECK(stiffness(pressed, Tangent::kSemidefinite).norm() == 0);
  const Eigen::VectorXd eigenvalues =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(stiffness(pulling, Tangent::kSemidefinite), false)
          .eigenvalues();
  CHECK(eigenvalues.minCoeff() > -1e-12 * eigenvalues.maxCoeff());
}

TEST_CASE("Displacements are zero at rest, and a cavity's volume is what its box holds", "[law]") {
  const Chamber chamber;
  const Constraints& c = chamber.constraints;
  CHECK(c.displacement(chamber.model.rest()).norm() == 0);
  CHECK(c.effector_position(chamber.model.rest())[2] == Approx(Chamber::kVolume));
  for (int a = 0; a < c.actuators(); ++a) CHECK(c.pull_only(a) == (a == Chamber::kCable));
}

TEST_CASE("A mean of points stands between them, whatever part of them is held", "[law]") {
  const Chamber chamber;
  const PointEffector mean{{chamber.at(0.002, 0.004, 0.012), chamber.at(0.03, 0.016, 0.017)},
                           {true, false, true}};
  const Constraints constraints(chamber.model, {}, {mean});
  const Eigen::VectorXd p = constraints.effector_position(chamber.model.rest());
  REQUIRE(p.size() == 2);
  CHECK(p[0] == Approx(0.016));
  CHECK(p[1] == Approx(0.0145));  // z, for y is not controlled
}

TEST_CASE("A cavity's volume grows with the third power of its size", "[law]") {
  const Chamber chamber;
  const Eigen::VectorXd larger = 1.1 * chamber.model.rest();  // the fixed nodes are not on the wall
  CHECK(chamber.constraints.effector_position(larger)[2] == Approx(1.331 * Chamber::kVolume));
  CHECK(chamber.constraints.displacement(larger)[Chamber::kPressure] == Approx(0.331 * Chamber::kVolume));
}

TEST_CASE("Pressure pushes the wall outward, without net force or moment", "[law]") {
  const unsigned seed = GENERATE(57u, 58u);
  CAPTURE(seed);
  Posed chamber(seed, 0);
  Eigen::MatrixXd J_aT(chamber.model.unknowns(), Chamber::kActuators);
  chamber.constraints.actuator_directions(chamber.x, J_aT);
  const auto forces =
      J_aT.col(Chamber::kPressure).reshaped(3, chamber.model.free_nodes());  // a unit pressure's
  const auto places = chamber.x.reshaped(3, chamber.model.free_nodes());
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  double virial = 0;
  for (int i = 0; i < forces.cols(); ++i) {
    const Eigen::Vector3d force = forces.col(i), place = places.col(i);
    moment += place.cross(force);
    virial += place.dot(force);
  }
  CHECK(forces.rowwise().sum().norm() < 1e-12 * forces.norm());
  CHECK(moment.norm() < 1e-12 * forces.norm());
  // A homogeneous function of degree three: x · ∂V/∂x = 3 V [Euler].
  CHECK(virial == Approx(3 * chamber.constraints.effector_position(chamber.x)[2]));
}

TEST_CASE("The work of an actuator is the energy that the body stores", "[law]") {
  const int a = GENERATE(0, 1, 2, 3, 4);
  CAPTURE(a);
  const Chamber chamber;
  const Constraints driven(chamber.model, {chamber.actuators()[a]}, {});
  const double reach = a == Chamber::kPressure ? 0.2 * Chamber::kVolume : 0.002;  // m³ or m
  // Simpson's rule over imposed displacements from rest.
  constexpr int kIntervals = 6;
  Equilibrium body(chamber.model, driven);
  double work = 0;
  for (int k = 0; k <= kIntervals; ++k) {
    const double delta = reach * k / kIntervals;
    const EquilibriumResult settled =
        body.settle_at_displacements(Eigen::VectorXd::Constant(1, delta), EffortSign::kPullOnly, 1e-11);
    REQUIRE(settled.converged);
    CHECK(driven.displacement(body.x())[0] == Approx(delta).margin(1e-12 * reach));
    CHECK((k == 0 ? std::abs(settled.lambda[0]) < 1e-9 : settled.lambda[0] > 0));
    const double weight = k == 0 || k == kIntervals ? 1 : k % 2 ? 4 : 2;
    work += weight * settled.lambda[0] * reach / kIntervals / 3;
  }
  CHECK(work == Approx(chamber.model.energy(body.x())).epsilon(1e-3));
}

/// Newton steps to equilibrium under a pressure, with the load's own stiffness or without.
std::vector<double> newton_moves(const Chamber& chamber, const Constraints& inflated, double pressure,
                                 bool with_stiffness, int steps) {
  const Model& model = chamber.model;
  const Eigen::VectorXd lambda = Eigen::VectorXd::Constant(1, pressure);
  StiffnessMatrix K = model.make_stiffness(inflated.cliques());
  Assembler assembler(model, K);
  CholmodFactor factor(K);
  Eigen::VectorXd x = model.rest(), f;
  Eigen::MatrixXd J_aT(model.unknowns(), 1), dx;
  std::vector<double> moves;
  for (int k = 0; k < steps; ++k) {
    REQUIRE(assembler.assemble(x, Tangent::kExact, f, K) == 0);
    if (with_stiffness) inflated.add_stiffness(x, lambda, Tangent::kExact, K);
    REQUIRE(factor.factorize(K));
    inflated.actuator_directions(x, J_aT);
    factor.solve(f + model.external_forces() + J_aT * lambda, dx);
    x += dx;
    moves.push_back(dx.lpNorm<Eigen::Infinity>());
  }
  return moves;
}

TEST_CASE("With the pressure's own stiffness Newton's method converges quadratically, without it linearly",
          "[law]") {
  const Chamber chamber;
  const Constraints inflated(chamber.model, {Pressure{chamber.wall}}, {});
  const double pressure = 20e3;  // Pa; the cavity's walls move by 1.5 mm
  const auto with = newton_moves(chamber, inflated, pressure, true, 5);
  const auto without = newton_moves(chamber, inflated, pressure, false, 12);
  for (size_t k = 0; k < without.size(); ++k)
    UNSCOPED_INFO(k << ": " << (k < with.size() ? with[k] : 0) << ", " << without[k] << " m");
  for (size_t k = 1; k < with.size(); ++k) CHECK(with[k] < 2000 * with[k - 1] * with[k - 1]);  // 2000 / m
  CHECK(with.back() < 1e-11);
  for (size_t k = 1; k < without.size(); ++k) CHECK(without[k] > 0.05 * without[k - 1]);
  CHECK(without.back() > 1e-10);
}

TEST_CASE("Actuators and effectors that nothing can move, or of bad geometry, are refused", "[unit]") {
  const Chamber chamber;
  const Model& model = chamber.model;
  const Attachment held = chamber.at(0, 0.004, 0.012), tip = chamber.at(0.03, 0.004, 0.012);
  const Eigen::Vector3d guide(-0.02, 0, 0);
  const auto refusal = [&](std::vector<Actuator> actuators, std::vector<Effector> effectors) -> std::string {
    try {
      const Constraints constraints(model, actuators, effectors);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  };
  const Cable good{{tip, guide}};
  CHECK_THAT(refusal({good, Cable{{held, guide}}}, {}),
             Contains("actuator 1: it is attached to fixed nodes only"));
  CHECK_THAT(refusal({}, {PointEffector{{held}}}),
             Contains("effector 0: it is attached to fixed nodes only"));
  CHECK_THAT(refusal({Cable{{tip}}}, {}), Contains("actuator 0: a cable has 1 points"));
  CHECK_THAT(refusal({Cable{{tip, guide, guide}}}, {}), Contains("points 1 and 2 coincide"));
  CHECK_THAT(refusal({good, Rod{tip, tip}}, {}), Contains("actuator 1: its points 0 and 1 coincide"));
  CHECK_THAT(refusal({Force{tip, {0, 0, 0}}}, {}), Contains("the direction of a force has no length"));
  CHECK_THAT(refusal({}, {PointEffector{}}), Contains("effector 0: it has no point"));
  std::vector<Face> leaking = chamber.wall;
  leaking.pop_back();
  CHECK_THAT(refusal({Pressure{leaking}}, {}), Contains("actuator 0: the surface is open at 3 of its edges"));
  CHECK_THAT(refusal({}, {VolumeEffector{leaking}}), Contains("effector 0: the surface is open"));
}

TEST_CASE("A stiffness matrix of another pattern is refused", "[unit]") {
  const Chamber chamber;
  StiffnessMatrix K = chamber.model.make_stiffness({});
  CHECK_THROWS_WITH(chamber.constraints.add_stiffness(
                        chamber.model.rest(), Eigen::VectorXd::Ones(Chamber::kActuators), Tangent::kExact, K),
                    Contains("was not made with the cliques"));
}

}  // namespace tendril::fem::constraints_test
