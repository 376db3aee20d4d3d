// SPDX-License-Identifier: Apache-2.0
#include "app/robot/model_refresher.h"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <limits>
#include <memory>

#include "app/config/load_config.h"
#include "qp/solver.h"
#include "tests/app/program/programs.h"

// The model thread's work on the finger: what a snapshot says is what the body does.

namespace tendril::app::model_refresher_test {

constexpr double kClose_m = 1e-8;

struct Finger {
  explicit Finger(fem::LinearSolverKind solver = fem::LinearSolverKind::kDirect,
                  fem::Tangent tangent = fem::Tangent::kExact)
      : config(load_config(std::string(TENDRIL_SOURCE_DIR) + "/config/finger.yaml")) {
    config.control.model_solver = solver;
    config.control.model_tangent = tangent;
  }

  /// Shortenings that the snapshot predicts under efforts, m.
  Eigen::VectorXd lengths(const Eigen::VectorXd& lambda) const {
    return snapshot->W_aa * lambda + snapshot->delta_a_free;
  }
  Eigen::VectorXd tip(const Eigen::VectorXd& lambda) const {
    return snapshot->W_ea * lambda + snapshot->p_e_free;
  }

  Config config;
  std::unique_ptr<Robot> robot = build_model(config);
  ModelRefresher model{*robot, config};
  std::unique_ptr<rt::Snapshot> snapshot = std::make_unique<rt::Snapshot>();
  rt::Feedback nothing;  // the controller has told no efforts yet
};

rt::Feedback efforts(const Eigen::VectorXd& lambda) {
  rt::Feedback feedback;
  feedback.efforts_known = true;
  feedback.lambda = lambda;
  return feedback;
}

TEST_CASE("The first snapshot after settling predicts the measured lengths and the body's own tip", "[law]") {
  Finger f;
  const Eigen::Vector2d measured = GENERATE(Eigen::Vector2d(1e-3, 0.5e-3), Eigen::Vector2d(1e-3, 2e-3));
  REQUIRE(f.model.settle(measured));
  REQUIRE(f.model.refresh(f.nothing, 42, *f.snapshot));
  const Eigen::VectorXd lambda = f.snapshot->lambda;
  CAPTURE(measured.transpose(), lambda.transpose());
  REQUIRE((lambda.array() > 0).all());  // taut: a slack cable would be shorter than what is let out
  CHECK((f.lengths(lambda) - measured).lpNorm<Eigen::Infinity>() < kClose_m);
  const Eigen::VectorXd p_e = f.robot->constraints.effector_position(f.model.x());
  CHECK((f.tip(lambda) - p_e).lpNorm<Eigen::Infinity>() < kClose_m);
  CHECK(f.snapshot->stamp_ns == 42);
}

TEST_CASE("Until efforts are asked for, the body follows the lengths that are measured anew", "[law]") {
  Finger f;
  const Eigen::Vector2d settled(1e-3, 0.5e-3), moved(2e-3, 1e-3);
  REQUIRE(f.model.settle(settled));
  REQUIRE(f.model.refresh(f.nothing, 0, *f.snapshot));
  const Eigen::VectorXd before = f.model.x(), lambda = f.snapshot->lambda;
  rt::Feedback feedback;
  feedback.delta_a = moved;
  SECTION("they are not known") {
    REQUIRE(f.model.refresh(feedback, 0, *f.snapshot));
    CHECK(f.model.x() == before);
    CHECK(f.snapshot->lambda == lambda);
  }
  feedback.displacements_known = true;
  SECTION("they have changed") {
    REQUIRE(f.model.refresh(feedback, 0, *f.snapshot));
    CHECK((f.lengths(f.snapshot->lambda) - moved).lpNorm<Eigen::Infinity>() < kClose_m);
    const Eigen::VectorXd there = f.model.x();
    REQUIRE(f.model.refresh(feedback, 0, *f.snapshot));  // they are those by now
    CHECK(f.model.x() == there);
  }
  SECTION("one has hardly changed") {
    const double hardly = 1e-6;  // m, less than its cable runs in a millisecond
    feedback.delta_a = settled + Eigen::Vector2d(0, hardly);
    REQUIRE(f.model.refresh(feedback, 0, *f.snapshot));
    CHECK(f.model.x() == before);
  }
  SECTION("one alone has changed") {
    feedback.delta_a = Eigen::Vector2d(settled[0], moved[1]);
    REQUIRE(f.model.refresh(feedback, 0, *f.snapshot));
    CHECK((f.lengths(f.snapshot->lambda) - feedback.delta_a).lpNorm<Eigen::Infinity>() < kClose_m);
  }
  SECTION("they are none that a body can have") {
    feedback.delta_a = Eigen::Vector2d(std::numeric_limits<double>::quiet_NaN(), 0);
    CHECK_FALSE(f.model.refresh(feedback, 0, *f.snapshot));
    CHECK(f.snapshot->sequence == 1);
    REQUIRE(f.model.refresh(f.nothing, 0, *f.snapshot));
    CHECK(f.model.x() == before);
  }
  SECTION("efforts are asked for") {
    feedback.efforts_known = true;
    feedback.lambda = lambda;
    REQUIRE(f.model.refresh(feedback, 0, *f.snapshot));
    CHECK((f.model.x() - before).lpNorm<Eigen::Infinity>() < kClose_m);
    CHECK(f.snapshot->lambda == lambda);
  }
}

TEST_CASE("A slack cable has no tension, and its path is shorter than the cable", "[law]") {
  Finger f;
  const Eigen::Vector2d measured(2e-3, -5e-3);  // bent to the right, with the left cable let out
  REQUIRE(f.model.settle(measured));
  REQUIRE(f.model.refresh(f.nothing, 0, *f.snapshot));
  const Eigen::VectorXd lambda = f.snapshot->lambda;
  CHECK(lambda[0] > 0);
  CHECK(lambda[1] == 0);
  CHECK(f.lengths(lambda)[0] == Approx(measured[0]).margin(kClose_m));
  CHECK(f.lengths(lambda)[1] > measured[1] + 1e-4);
}

TEST_CASE("A snapshot's matrices tell what a small change of effort does", "[law]") {
  Finger f;
  REQUIRE(f.model.settle(Eigen::Vector2d(1e-3, 0.5e-3)));
  REQUIRE(f.model.refresh(f.nothing, 0, *f.snapshot));
  const rt::Snapshot before = *f.snapshot;
  const Eigen::VectorXd rest_tip = f.tip(before.lambda), rest_lengths = f.lengths(before.lambda);
  const Eigen::Vector2d change(1e-4, -0.5e-4);  // N
  const rt::Feedback pulled = efforts(before.lambda + change);
  for (int k = 0; k < 5; ++k) REQUIRE(f.model.refresh(pulled, 0, *f.snapshot));
  const Eigen::VectorXd moved = f.tip(pulled.lambda) - rest_tip;
  const Eigen::VectorXd drawn = f.lengths(pulled.lambda) - rest_lengths;
  CHECK((moved - before.W_ea * change).norm() < 1e-2 * moved.norm());
  CHECK((drawn - before.W_aa * change).norm() < 1e-2 * drawn.norm());
}

TEST_CASE("Refreshes under constant efforts bring the body to the equilibrium of these efforts", "[law]") {
  const auto solver = GENERATE(fem::LinearSolverKind::kDirect, fem::LinearSolverKind::kReused);
  const auto tangent = GENERATE(fem::Tangent::kExact, fem::Tangent::kSemidefinite);
  CAPTURE(solver == fem::LinearSolverKind::kReused, tangent == fem::Tangent::kExact);
  Finger f(solver, tangent);
  REQUIRE(f.model.settle(Eigen::Vector2d::Zero()));
  REQUIRE(f.model.refresh(f.nothing, 0, *f.snapshot));
  const Eigen::Vector2d lambda(0.8, 0.2);
  for (int k = 0; k < 30; ++k) REQUIRE(f.model.refresh(efforts(lambda), 0, *f.snapshot));
  fem::Equilibrium reference(f.robot->model, f.robot->constraints);
  REQUIRE(reference.settle_under_efforts(lambda, 1e-10).converged);
  CHECK((f.model.x() - reference.x()).lpNorm<Eigen::Infinity>() < kClose_m);
  CHECK(f.snapshot->lambda == lambda);
  CHECK(f.snapshot->sequence == 31);
}

TEST_CASE("After one long step the exact tangent sees a body that is far stiffer than it is", "[law]") {
  const auto change_of_W = [](fem::Tangent tangent) {
    Config config = load_config(std::string(TENDRIL_SOURCE_DIR) + "/config/diamond.yaml");
    config.control.model_tangent = tangent;
    const auto robot = build_model(config);
    ModelRefresher model(*robot, config);
    const auto snapshot = std::make_unique<rt::Snapshot>();
    REQUIRE(model.settle(Eigen::Vector4d::Zero()));
    REQUIRE(model.refresh({}, 0, *snapshot));
    const qp::Matrix before = snapshot->W_aa;
    REQUIRE(model.refresh(efforts(Eigen::Vector4d::Ones()), 0, *snapshot));  // some 5 mm at the tip
    return (snapshot->W_aa - before).norm() / before.norm();
  };
  const double exact = change_of_W(fem::Tangent::kExact);
  const double semidefinite = change_of_W(fem::Tangent::kSemidefinite);
  CAPTURE(exact, semidefinite);
  CHECK(exact > 2 * semidefinite);
}

TEST_CASE(
    "Of the efforts that bring the tip to a target the QP of a snapshot takes those of the least energy",
    "[law]") {
  Finger f;
  REQUIRE(f.model.settle(Eigen::Vector2d(1e-3, 0.5e-3)));
  REQUIRE(f.model.refresh(f.nothing, 0, *f.snapshot));
  const rt::Snapshot& s = *f.snapshot;
  const double target = GENERATE(-2e-3, 3e-3);  // m, from where the tip is without efforts
  const qp::Vector g = -s.D_W_ea.transpose() * rt::EffectorVector::Constant(1, target);
  const qp::Vector far = qp::Vector::Constant(2, 1e3);
  qp::Solver solver;
  const qp::Solution& found = solver.solve(s.problem, g, {-far, far, -far, far}, qp::Vector::Zero(2), 32);
  REQUIRE(found.status == qp::Status::kOptimal);
  // W_aa λ = W_eaᵀ ν at the least ½ λᵀ W_aa λ subject to W_ea λ = target.
  const Eigen::VectorXd per_nu = s.W_aa.llt().solve(s.W_ea.transpose());
  const Eigen::VectorXd least = per_nu * (target / s.W_ea.row(0).dot(per_nu));
  CAPTURE(found.x.transpose(), least.transpose());
  CHECK((found.x - least).norm() < 1e-5 * least.norm());
}

TEST_CASE("A refresh that fails keeps the last good pose and says so, and good efforts serve again",
          "[unit]") {
  const auto solver = GENERATE(fem::LinearSolverKind::kDirect, fem::LinearSolverKind::kReused);
  CAPTURE(solver == fem::LinearSolverKind::kReused);
  Finger f(solver);
  REQUIRE(f.model.settle(Eigen::Vector2d(1e-3, 0.5e-3)));
  REQUIRE(f.model.refresh(f.nothing, 0, *f.snapshot));
  const Eigen::VectorXd good_x = f.model.x();
  const Eigen::VectorXd good_lambda = f.snapshot->lambda;
  const double bad =
      GENERATE(std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity());
  CAPTURE(bad);
  for (int k = 0; k < 3; ++k) {
    CHECK_FALSE(f.model.refresh(efforts(Eigen::Vector2d(bad, 0.1)), 0, *f.snapshot));
    CHECK(f.model.x() == good_x);
  }
  REQUIRE(f.model.refresh(efforts(good_lambda), 0, *f.snapshot));
  CHECK((f.model.x() - good_x).lpNorm<Eigen::Infinity>() < kClose_m);
}

TEST_CASE("Efforts beyond all reason do not turn the body inside out for good", "[unit]") {
  Finger f;
  REQUIRE(f.model.settle(Eigen::Vector2d(1e-3, 0.5e-3)));
  REQUIRE(f.model.refresh(f.nothing, 0, *f.snapshot));
  const Eigen::VectorXd good_lambda = f.snapshot->lambda;
  int refused = 0;
  for (int k = 0; k < 50; ++k) {
    const Eigen::VectorXd before = f.model.x();
    if (f.model.refresh(efforts(Eigen::Vector2d(1e4, 0)), 0, *f.snapshot)) continue;
    ++refused;
    CHECK(f.model.x() == before);
  }
  CHECK(refused > 0);
  for (int k = 0; k < 60; ++k) (void)f.model.refresh(efforts(good_lambda), 0, *f.snapshot);
  REQUIRE(f.model.refresh(efforts(good_lambda), 0, *f.snapshot));
  CHECK((f.lengths(good_lambda) - Eigen::Vector2d(1e-3, 0.5e-3)).lpNorm<Eigen::Infinity>() < kClose_m);
}

}  // namespace tendril::app::model_refresher_test
