// SPDX-License-Identifier: Apache-2.0
#include "tests/qp/brute_force.h"

#include <Eigen/LU>
#include <cmath>
#include <vector>

namespace tendril::qp {
namespace {

constexpr double kTolerance = 1e-8;

/// The problem with variables and rows scaled to about one, and the search over its active sets.
class Enumeration {
 public:
  Enumeration(const Qp& qp, const Eigen::MatrixXd& fixed, const Eigen::VectorXd& values)
      : n_(static_cast<int>(qp.g.size())), count_(n_ + qp.rows()), scale_(n_), values_(values) {
    for (int j = 0; j < n_; ++j) scale_[j] = 1 / std::sqrt(qp.H(j, j));
    H_ = scale_.asDiagonal() * qp.H * scale_.asDiagonal();
    g_ = scale_.asDiagonal() * qp.g;
    fixed_.resize(fixed.rows(), n_);
    if (fixed.rows() > 0) fixed_ = fixed * scale_.asDiagonal();
    C_.resize(count_, n_);
    C_.topRows(n_).setIdentity();
    C_.bottomRows(qp.rows()) = qp.A * scale_.asDiagonal();
    lower_.resize(count_);
    upper_.resize(count_);
    lower_ << qp.bounds.lower.cwiseQuotient(scale_), qp.bounds.row_lower;
    upper_ << qp.bounds.upper.cwiseQuotient(scale_), qp.bounds.row_upper;
    for (int k = n_; k < count_; ++k) {
      const double norm = C_.row(k).norm();
      if (norm == 0) continue;
      C_.row(k) /= norm;
      lower_[k] /= norm;
      upper_[k] /= norm;
    }
  }

  std::optional<Vector> run() {
    for (int count = 0; count <= n_; ++count)
      if (extend(0, count)) return scale_.asDiagonal() * x_;
    return std::nullopt;
  }

 private:
  struct Active {
    int k, side;  // -1 lower, 1 upper, 0 both
    double bound;
  };

  bool extend(int from, int count) {
    if (count == 0) return optimal();
    for (int k = from; k + count <= count_; ++k) {
      for (const int side : {-1, 1}) {
        const double bound = side < 0 ? lower_[k] : upper_[k];
        const bool equality = lower_[k] == upper_[k];
        if (std::isinf(bound) || (equality && side > 0)) continue;
        active_.push_back({k, equality ? 0 : side, bound});
        if (extend(k + 1, count - 1)) return true;
        active_.pop_back();
      }
    }
    return false;
  }

  bool optimal() {
    const int m = static_cast<int>(active_.size()), c = static_cast<int>(fixed_.rows());
    Eigen::MatrixXd kkt = Eigen::MatrixXd::Zero(n_ + m + c, n_ + m + c);
    Eigen::VectorXd rhs(n_ + m + c);
    kkt.topLeftCorner(n_, n_) = H_;
    rhs.head(n_) = -g_;
    for (int i = 0; i < m; ++i) {
      kkt.row(n_ + i).head(n_) = C_.row(active_[i].k);
      kkt.col(n_ + i).head(n_) = C_.row(active_[i].k).transpose();
      rhs[n_ + i] = active_[i].bound;
    }
    if (c > 0) {
      kkt.block(n_ + m, 0, c, n_) = fixed_;
      kkt.block(0, n_ + m, n_, c) = fixed_.transpose();
      rhs.tail(c) = values_;
    }
    Eigen::FullPivLU<Eigen::MatrixXd> lu(kkt);
    lu.setThreshold(1e-10);
    if (!lu.isInvertible()) return false;
    const Eigen::VectorXd solution = lu.solve(rhs);
    x_ = solution.head(n_);
    for (int i = 0; i < m; ++i)
      if (active_[i].side * solution[n_ + i] < -kTolerance * (1 + g_.norm())) return false;
    const Eigen::VectorXd value = C_ * x_;
    for (int k = 0; k < count_; ++k) {
      const double tolerance = kTolerance * (1 + x_.norm());
      if (value[k] < lower_[k] - tolerance || value[k] > upper_[k] + tolerance) return false;
    }
    return true;
  }

  int n_, count_;  // variables; constraints
  Vector scale_, x_;
  Eigen::MatrixXd H_, C_, fixed_;
  Eigen::VectorXd g_, lower_, upper_, values_;
  std::vector<Active> active_;
};

}  // namespace

std::optional<Vector> solve_by_brute_force(const Qp& qp, const Eigen::MatrixXd& fixed,
                                           const Eigen::VectorXd& values) {
  return Enumeration(qp, fixed, values).run();
}

}  // namespace tendril::qp
