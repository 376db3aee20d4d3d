// SPDX-License-Identifier: Apache-2.0
#include "app/robot/model_refresher.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <vector>

namespace tendril::app {
namespace {

constexpr double kRestAccuracy = 1e-9;  // m
// An actuator that stands further than this from where it stood before the start has been moved.
constexpr double kMoved = 1e-3;  // s at its top rate

// Of the strongest combination of displacements.
constexpr double kWeakest = 1e-4;
// A cable with so little of its largest tension is slack.
constexpr double kSlackShare = 1e-3;

/// ‖M‖∞, the largest absolute row sum.
double infinity_norm(const qp::Matrix& M) { return M.cwiseAbs().rowwise().sum().maxCoeff(); }

}  // namespace

double error_per_joule(const qp::Matrix& H, const qp::Matrix& W_aa, const Eigen::ArrayX<bool>& pressure) {
  rt::ActuatorVector scale(W_aa.rows());
  for (const bool unit : {false, true}) {
    double softest = 0;
    for (Eigen::Index a = 0; a < scale.size(); ++a)
      if (pressure[a] == unit) softest = std::max(softest, W_aa(a, a));
    for (Eigen::Index a = 0; a < scale.size(); ++a)
      if (pressure[a] == unit) scale[a] = 1 / std::sqrt(softest);
  }
  const qp::Matrix scaled_H = scale.asDiagonal() * H * scale.asDiagonal();
  const qp::Matrix scaled_W = scale.asDiagonal() * W_aa * scale.asDiagonal();
  return infinity_norm(scaled_H) / infinity_norm(scaled_W);
}

rt::CouplingMatrix effectors_per_displacement(const rt::CouplingMatrix& W_ea, const qp::Matrix& W_aa,
                                              const Eigen::ArrayX<bool>& prescribed) {
  std::vector<Eigen::Index> p;
  for (Eigen::Index a = 0; a < prescribed.size(); ++a)
    if (prescribed[a]) p.push_back(a);
  rt::CouplingMatrix G = rt::CouplingMatrix::Zero(W_ea.rows(), W_ea.cols());
  if (p.empty()) return G;
  // In units that put ½ J into each actuator.
  const Eigen::VectorXd scale = Eigen::VectorXd(W_aa.diagonal()(p)).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd W_pp = scale.asDiagonal() * Eigen::MatrixXd(W_aa(p, p)) * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(W_pp);
  const Eigen::VectorXd& value = modes.eigenvalues();
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(value.size());
  for (Eigen::Index k = 0; k < value.size(); ++k)
    if (value[k] > kWeakest * value[value.size() - 1]) inverse[k] = 1 / value[k];
  const Eigen::MatrixXd& V = modes.eigenvectors();
  G(Eigen::all, p) = Eigen::MatrixXd(W_ea(Eigen::all, p)) * scale.asDiagonal() * V * inverse.asDiagonal() *
                     V.transpose() * scale.asDiagonal();
  return G;
}

ModelRefresher::ModelRefresher(const Robot& robot, const Config& config)
    : epsilon_(config.control.epsilon),
      tangent_(config.control.model_tangent),
      weights_(robot.constraints.effector_coordinates()),
      moved_(robot.constraints.actuators()),
      pressure_(robot.constraints.actuators()),
      feedback_(!measured_coordinates(config).empty()),
      follows_displacement_(robot.constraints.actuators()),
      slack_(robot.constraints.actuators()),
      equilibrium_(robot.model, robot.constraints, config.control.model_solver),
      lambda_(Eigen::VectorXd::Zero(robot.constraints.actuators())),
      last_good_x_(robot.model.rest()),
      settled_at_(Eigen::VectorXd::Zero(robot.constraints.actuators())) {
  const auto rows = effector_rows(config);
  for (size_t r = 0; r < rows.size(); ++r) weights_[static_cast<Eigen::Index>(r)] = rows[r].weight;
  for (Eigen::Index a = 0; a < moved_.size(); ++a) {
    moved_[a] = kMoved * config.actuators[a].top_rate;
    const ActuatorConfig& actuator = config.actuators[a];
    pressure_[a] = actuator.is_cavity();
    follows_displacement_[a] = !actuator.follows_effort();
    slack_[a] = actuator.effort_min < 0 ? -std::numeric_limits<double>::infinity()
                                        : kSlackShare * actuator.effort_max;
  }
}

bool ModelRefresher::settle(const Eigen::VectorXd& delta_a) {
  const fem::EquilibriumResult settled =
      equilibrium_.settle_at_displacements(delta_a, fem::EffortSign::kPullOnly, kRestAccuracy);
  if (!settled.converged) return false;
  lambda_ = settled.lambda;
  last_good_x_ = equilibrium_.x();
  settled_at_ = delta_a;
  moved_by_efforts_ = false;
  return true;
}

bool ModelRefresher::refresh(const rt::Feedback& feedback, int64_t now_ns, rt::Snapshot& snapshot) {
  // While the controller asks for no efforts, actuators may be moved by hand.
  if (!feedback.efforts_known && feedback.displacements_known && !rests_at(feedback.delta_a) &&
      !settle(feedback.delta_a))
    return false;
  asked_ = lambda_;
  if (feedback.efforts_known) {
    asked_ = feedback.lambda;
    equilibrium_.advance(asked_);
    moved_by_efforts_ = true;
  }
  if (equilibrium_.linearise(asked_, tangent_) != fem::LinearisationStatus::kUsable ||
      !fill(equilibrium_.compliance(), asked_, now_ns, snapshot)) {
    // The responses kept for the next step must belong to the pose it starts from, and to efforts that are
    // known to serve there: those of this call may be what failed.
    equilibrium_.set_x(last_good_x_);
    (void)equilibrium_.linearise(lambda_, tangent_);
    return false;
  }
  last_good_x_ = equilibrium_.x();
  lambda_ = asked_;
  return true;
}

bool ModelRefresher::rests_at(const Eigen::VectorXd& delta_a) const {
  return !moved_by_efforts_ && ((delta_a - settled_at_).array().abs() < moved_.array()).all();
}

bool ModelRefresher::fill(const fem::Compliance& compliance, const Eigen::VectorXd& lambda, int64_t now_ns,
                          rt::Snapshot& snapshot) {
  const rt::CouplingMatrix weighed = weights_.asDiagonal() * compliance.W_ea;
  qp::Matrix H = weighed.transpose() * weighed;
  qp::TieBreak tie_break = qp::TieBreak::kLeastEnergy;
  if (epsilon_ > 0) {
    H += epsilon_ * error_per_joule(H, compliance.W_aa, pressure_) * compliance.W_aa;
    tie_break = qp::TieBreak::kAny;  // it has a single solution
  }
  snapshot.stamp_ns = now_ns;
  snapshot.W_ea = compliance.W_ea;
  snapshot.D_W_ea = weights_.asDiagonal() * weighed;
  snapshot.W_aa = compliance.W_aa;
  if (feedback_)
    snapshot.G_ea = effectors_per_displacement(compliance.W_ea, compliance.W_aa,
                                               follows_displacement_ && lambda.array() > slack_);
  snapshot.delta_a_free = compliance.delta_a_free;
  snapshot.p_e_free = compliance.p_e_free;
  snapshot.lambda = lambda;
  if (snapshot.problem.prepare(H, snapshot.W_aa, tie_break) != qp::Preparation::kReady) return false;
  snapshot.sequence = ++sequence_;
  return true;
}

void linearise_at_rest(const Robot& robot, const Config& config, int64_t now_ns, rt::Snapshot& snapshot) {
  ModelRefresher model(robot, config);
  (void)model.settle(Eigen::VectorXd::Zero(robot.constraints.actuators()));
  if (!model.refresh({}, now_ns, snapshot))
    throw ConfigError(
        fmt::format("{}: the model cannot be linearised at rest, so that the time of the QP "
                    "is unknown; set control.iteration_cap",
                    config.file.string()));
}

}  // namespace tendril::app
