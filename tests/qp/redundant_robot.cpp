// SPDX-License-Identifier: Apache-2.0
#include "tests/qp/redundant_robot.h"

#include <cmath>

namespace tendril::qp {
namespace {

constexpr int kBody = 40;  // degrees of freedom of the body
constexpr int kCyclesPerSnapshot = 5;
constexpr double kEffort = 8;
constexpr double kDrift = 2e-3;  // of J, from one snapshot to the next

Eigen::MatrixXd normal(std::mt19937_64& random, int rows, int cols) {
  std::normal_distribution<double> distribution;
  return Eigen::MatrixXd::NullaryExpr(rows, cols, [&] { return distribution(random); });
}

}  // namespace

RedundantRobot::Cycle RedundantRobot::cycle(int i, double reach) const {
  std::mt19937_64 random(seed);
  const Eigen::MatrixXd J_own = normal(random, actuators, kBody) / std::sqrt(kBody),
                        J_e = normal(random, coordinates, kBody) / std::sqrt(kBody),
                        drift = normal(random, actuators, kBody) / std::sqrt(kBody);
  const Eigen::VectorXd phase = Eigen::VectorXd::NullaryExpr(
      coordinates, [&] { return std::uniform_real_distribution<double>(0, 6.3)(random); });
  const Eigen::MatrixXd other = normal(random, 32, kBody) / std::sqrt(kBody);

  const int snapshot = i / kCyclesPerSnapshot;
  const double angle = kDrift * snapshot;
  Eigen::MatrixXd J(n(), kBody);
  J.topRows(actuators) = std::cos(angle) * J_own + std::sin(angle) * drift;
  for (int k = actuators; k < n(); ++k) {
    const Eigen::RowVectorXd like = J.row((k - actuators) % actuators);
    switch (added) {
      case Added::kNone:
      case Added::kDuplicate:
        J.row(k) = like;
        break;
      case Added::kNear:
        J.row(k) = like + distance * other.row(k - actuators);
        break;
      case Added::kOpposite:
        J.row(k) = -like;
        break;
      case Added::kOther:
        J.row(k) = other.row(k - actuators);
    }
  }
  Cycle result;
  result.new_snapshot = i % kCyclesPerSnapshot == 0;
  result.W_ea = J_e * J.transpose();
  result.A = J * J.transpose();
  result.A = ((result.A + result.A.transpose()) / 2).eval();
  result.H = result.W_ea.transpose() * result.W_ea;
  if (epsilon > 0) {
    const double ratio =
        result.H.cwiseAbs().rowwise().sum().maxCoeff() / result.A.cwiseAbs().rowwise().sum().maxCoeff();
    result.H += epsilon * ratio * result.A;
  }
  const double size = reach * kEffort * result.W_ea.leftCols(actuators).colwise().norm().mean();
  result.delta_e = Eigen::VectorXd::NullaryExpr(
      coordinates, [&](Eigen::Index k) { return size * std::sin(0.01 * i + phase[k]); });
  result.g = result.W_ea.transpose() * result.delta_e;
  const Vector free = Vector::Constant(n(), 0.02 * std::sin(0.003 * i));
  result.bounds.lower = Vector::Zero(n());
  result.bounds.upper = Vector::Constant(n(), kEffort);
  result.bounds.row_lower = Vector::Constant(n(), -20) - free;
  result.bounds.row_upper = Vector::Constant(n(), 12) - free;
  return result;
}

void limit_rate(const Vector& displacement, double step, Bounds& bounds) {
  const Vector low = (displacement.array() - step).matrix(), high = (displacement.array() + step).matrix();
  const Vector lower = bounds.row_lower.cwiseMax(low).cwiseMin(high),
               upper = bounds.row_upper.cwiseMin(high).cwiseMax(low);
  bounds.row_lower = lower;
  bounds.row_upper = upper;
}

}  // namespace tendril::qp
