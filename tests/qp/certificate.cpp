// SPDX-License-Identifier: Apache-2.0
#include "tests/qp/certificate.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>
#include <vector>

namespace tendril::qp {
namespace {

constexpr double kHeld = 1e-7;      // a row this near to its bound, relative to its terms, is held there
constexpr double kResponse = 1e-2;  // of Qp::row_response(), as a scale of the row beside its terms
constexpr double kSingular = 1e-6;

/// y ≥ 0 of least |M y - b|; the columns of M have length one.  [Lawson & Hanson 1974, algorithm NNLS]
Eigen::VectorXd least_squares_nonnegative(const Eigen::MatrixXd& M, const Eigen::VectorXd& b) {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(M.cols());
  std::vector<int> free;
  std::vector<bool> useless(M.cols());  // depends on the free ones, but for rounding
  for (int turn = 0; turn < 3 * M.cols(); ++turn) {
    const Eigen::VectorXd residual = b - M * y, slope = M.transpose() * residual;
    int enter = -1;
    double steepest = 1e-14 * b.norm();
    for (int k = 0; k < M.cols(); ++k) {
      if (y[k] == 0 && !useless[k] && slope[k] > steepest) enter = k, steepest = slope[k];
    }
    if (enter < 0) break;
    free.push_back(enter);
    while (!free.empty()) {
      const Eigen::VectorXd z = M(Eigen::all, free).completeOrthogonalDecomposition().solve(b);
      double step = 1;
      std::size_t blocks = free.size();
      for (std::size_t i = 0; i < free.size(); ++i) {
        if (z[i] > 0) continue;
        const double reach = y[free[i]] > 0 ? y[free[i]] / (y[free[i]] - z[i]) : 0;
        if (reach < step || blocks == free.size()) step = reach, blocks = i;
      }
      for (std::size_t i = 0; i < free.size(); ++i) y[free[i]] += step * (z[i] - y[free[i]]);
      if (blocks == free.size()) break;
      y[free[blocks]] = 0;
      free.erase(free.begin() + static_cast<std::ptrdiff_t>(blocks));
    }
    if (y[enter] == 0)
      useless[enter] = true;
    else
      useless.assign(M.cols(), false);
  }
  return y;
}

}  // namespace

double stationarity(const Qp& qp, const Vector& x) {
  const int n = static_cast<int>(x.size());
  const RowVector rows = qp.A * x;
  std::vector<Eigen::VectorXd> held;  // outward normals
  const auto collect = [&](double value, double lower, double upper, double scale, const Vector& normal) {
    if (upper - value <= kHeld * scale) held.push_back(normal);
    if (value - lower <= kHeld * scale) held.push_back(-normal);
  };
  for (int j = 0; j < n; ++j) {
    collect(x[j], qp.bounds.lower[j], qp.bounds.upper[j], 0, Vector::Unit(n, j));
  }
  for (int k = 0; k < qp.rows(); ++k) {
    collect(rows[k], qp.bounds.row_lower[k], qp.bounds.row_upper[k],
            qp.row_scale(x, k) + kResponse * qp.row_response(k), qp.A.row(k).transpose());
  }
  const Vector least = qp.H.diagonal() + 1e-300 * Vector::Ones(n);
  const auto metric = (qp.H + Matrix((kSingular * least).asDiagonal())).llt();
  const auto measured = [&](Eigen::VectorXd vector) { return metric.matrixL().solve(vector).eval(); };
  Eigen::MatrixXd normals(n, held.size()), M(n, held.size());
  for (std::size_t k = 0; k < held.size(); ++k) {
    M.col(k) = measured(held[k]);
    const double norm = M.col(k).norm();
    M.col(k) /= norm;
    normals.col(k) = held[k] / norm;
  }
  const Eigen::VectorXd gradient = measured(qp.H * x + qp.g);
  const Eigen::VectorXd y = least_squares_nonnegative(M, -gradient);
  const Eigen::VectorXd size =
      qp.H.cwiseAbs() * x.cwiseAbs() + qp.g.cwiseAbs() + Vector(normals.cwiseAbs() * y);
  const double objective_scale = size.dot(x.cwiseAbs()) + measured(qp.g).squaredNorm();
  const double left = (M * y + gradient).norm();
  return left == 0 ? 0 : left / std::sqrt(objective_scale);
}

}  // namespace tendril::qp
