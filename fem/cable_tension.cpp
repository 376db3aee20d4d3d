#include "fem/cable_tension.h"

#include <Eigen/Dense>

namespace tendril::fem {
namespace {

constexpr int kSweeps = 20000;
constexpr double kTolerance = 1e-13;  // m: far below what a drive resolves

}  // namespace

bool solve_tensions(const Eigen::MatrixXd& W_aa, const Eigen::VectorXd& delta_a_free,
                    const Eigen::VectorXd& delta_a, Sign sign, Eigen::VectorXd& lambda) {
  const Eigen::VectorXd gap = delta_a_free - delta_a;
  if (sign == Sign::kBilateral) {
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(W_aa);
    lambda = ldlt.solve(-gap);
    return lambda.allFinite() && (W_aa * lambda + gap).norm() <= 1e-9 * (gap.norm() + kTolerance);
  }
  if (!W_aa.allFinite() || !gap.allFinite() || (W_aa.diagonal().array() <= 0).any()) return false;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double largest = 0;
    for (int i = 0; i < lambda.size(); ++i) {
      const double w = W_aa.row(i).dot(lambda) + gap[i];
      const double next = std::max(0.0, lambda[i] - w / W_aa(i, i));
      largest = std::max(largest, std::abs(next - lambda[i]) * W_aa(i, i));
      lambda[i] = next;
    }
    if (largest < kTolerance) return true;
  }
  return false;
}

}  // namespace tendril::fem
