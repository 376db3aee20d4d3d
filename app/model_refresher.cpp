#include "app/model_refresher.h"

namespace tendril::app {
namespace {

constexpr double kSettled = 1e-9;  // m
// A cable whose length has changed by more than this before the start has been moved.
constexpr double kMoved = 1e-4;  // m

/// ‖M‖∞, the largest absolute row sum.
double infinity_norm(const Eigen::MatrixXd& M) { return M.cwiseAbs().rowwise().sum().maxCoeff(); }

}  // namespace

ModelRefresher::ModelRefresher(const Robot& robot, double epsilon)
    : epsilon_(epsilon),
      equilibrium_(robot.model, robot.constraints),
      lambda_(Eigen::VectorXd::Zero(robot.constraints.actuators())),
      last_good_x_(robot.model.rest()),
      settled_at_(Eigen::VectorXd::Zero(robot.constraints.actuators())) {}

bool ModelRefresher::settle(const Eigen::VectorXd& delta_a) {
  const fem::Settled settled = equilibrium_.settle_at_lengths(delta_a, fem::Sign::kPullOnly, kSettled);
  if (!settled.converged) return false;
  lambda_ = settled.lambda;
  last_good_x_ = equilibrium_.x();
  settled_at_ = delta_a;
  return true;
}

bool ModelRefresher::refresh(const rt::Feedback& feedback, std::int64_t now_ns, rt::Snapshot& snapshot) {
  // Until the controller asks for efforts, cables may still be moved by hand.
  if (!feedback.efforts_known && feedback.displacements_known && !near_settled(feedback.delta_a) &&
      !settle(feedback.delta_a))
    return false;
  Eigen::VectorXd lambda = lambda_;
  if (feedback.efforts_known) {
    lambda = feedback.lambda;
    equilibrium_.advance(lambda);
  }
  if (equilibrium_.linearise(lambda) != fem::Pose::kUsable ||
      !fill(equilibrium_.compliance(), lambda, now_ns, snapshot)) {
    // The responses kept for the next step must belong to the pose it starts from, and to efforts that are
    // known to serve there: those of this call may be what failed.
    equilibrium_.set_x(last_good_x_);
    (void)equilibrium_.linearise(lambda_);
    return false;
  }
  last_good_x_ = equilibrium_.x();
  lambda_ = lambda;
  return true;
}

bool ModelRefresher::near_settled(const Eigen::VectorXd& delta_a) const {
  return (delta_a - settled_at_).cwiseAbs().maxCoeff() < kMoved;
}

bool ModelRefresher::fill(const fem::Compliance& compliance, const Eigen::VectorXd& lambda,
                          std::int64_t now_ns, rt::Snapshot& snapshot) {
  Eigen::MatrixXd H = compliance.W_ea.transpose() * compliance.W_ea;
  H += epsilon_ * (infinity_norm(H) / infinity_norm(compliance.W_aa)) * compliance.W_aa;
  snapshot.stamp_ns = now_ns;
  snapshot.W_ea = snapshot.D_W_ea = compliance.W_ea;
  snapshot.W_aa = compliance.W_aa;
  snapshot.delta_a_free = compliance.delta_a_free;
  snapshot.p_e_free = compliance.p_e_free;
  snapshot.lambda = lambda;
  if (snapshot.problem.prepare(H, snapshot.W_aa) != qp::Preparation::kReady) return false;
  snapshot.sequence = ++sequence_;
  return true;
}

}  // namespace tendril::app
