// SPDX-License-Identifier: Apache-2.0
#include "app/robot/inverse_statics.h"

#include <memory>

#include "app/robot/model_refresher.h"
#include "rt/inverse_problem.h"

namespace tendril::app {
namespace {

constexpr int kRefreshes = 200;
constexpr double kSettled = 1e-8;  // m, of any node from one refresh to the next
constexpr double kEffort = 1e-6;   // of the efforts, of the range of each

}  // namespace

StaticSolution solve_inverse_statics(const Robot& robot, const Config& config,
                                     const rt::EffectorVector& goal) {
  StaticSolution result;
  const rt::ControllerConfig limits = controller_config(config);
  const rt::ActuatorVector small = kEffort * (limits.a_max - limits.a_min);
  ModelRefresher model(robot, config);
  const auto snapshot = std::make_unique<rt::Snapshot>();
  rt::InverseProblem problem(limits.a_min, limits.a_max, limits.iteration_cap);
  rt::Feedback feedback;
  if (!model.settle(Eigen::VectorXd::Zero(limits.actuators))) return result;
  feedback.lambda = rt::ActuatorVector::Zero(limits.actuators);
  while (!result.converged && result.refreshes < kRefreshes) {
    ++result.refreshes;
    const Eigen::VectorXd before = model.x();
    if (!model.refresh(feedback, 0, *snapshot)) return result;
    result.lambda = feedback.lambda;
    result.delta_a = robot.constraints.displacement(model.x());
    result.p_e = robot.constraints.effector_position(model.x());
    if (feedback.efforts_known && (model.x() - before).cwiseAbs().maxCoeff() < kSettled)
      result.converged = true;

    const qp::Solution& solution =
        problem.solve(*snapshot, goal, limits.l_min, limits.l_max, feedback.lambda);
    if (solution.status == qp::Status::kCapped || solution.status == qp::Status::kIllPosed) {
      result.converged = false;
      result.obstacle = solution.status == qp::Status::kCapped ? StaticSolution::Obstacle::kQpCapped
                                                               : StaticSolution::Obstacle::kQpIllPosed;
      return result;
    }
    result.converged =
        result.converged && ((solution.x - feedback.lambda).array().abs() <= small.array()).all();
    feedback.lambda = solution.x;
    feedback.efforts_known = true;
  }
  result.obstacle = StaticSolution::Obstacle::kNoRest;
  return result;
}

rt::EffectorVector effectors_at_rest(const Robot& robot) {
  fem::Equilibrium body(robot.model,
                        robot.constraints);  // stays in the shape of the mesh if it cannot settle
  (void)body.settle_at_displacements(Eigen::VectorXd::Zero(robot.constraints.actuators()),
                                     fem::EffortSign::kPullOnly, kSettled);
  return robot.constraints.effector_position(body.x());
}

}  // namespace tendril::app
