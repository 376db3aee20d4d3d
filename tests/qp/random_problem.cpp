// SPDX-License-Identifier: Apache-2.0
#include "tests/qp/random_problem.h"

#include <algorithm>
#include <cmath>

namespace tendril::qp {
namespace {

double uniform(std::mt19937_64& random, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(random);
}

bool chance(std::mt19937_64& random, double probability) { return uniform(random, 0, 1) < probability; }

Matrix normal(std::mt19937_64& random, int rows, int cols) {
  std::normal_distribution<double> distribution;
  Matrix result(rows, cols);
  for (int j = 0; j < cols; ++j)
    for (int i = 0; i < rows; ++i) result(i, j) = distribution(random);
  return result;
}

/// Bounds around `inside`, or where that is not asked for, around a point up to 2 away from it.
void draw_bounds(std::mt19937_64& random, bool around, bool finite, const Vector& inside, Vector& lower,
                 Vector& upper) {
  lower = upper = inside;
  for (int k = 0; k < inside.size(); ++k) {
    const double centre = inside[k] + (around ? 0 : uniform(random, -2, 2));
    lower[k] =
        !finite && chance(random, 0.2) ? -kInf : centre - (chance(random, 0.2) ? 0 : uniform(random, 0, 2));
    upper[k] =
        !finite && chance(random, 0.2) ? kInf : centre + (chance(random, 0.2) ? 0 : uniform(random, 0, 2));
    if (chance(random, 0.1)) lower[k] = upper[k] = centre;
  }
}

}  // namespace

RowVector Qp::violation(const Vector& x) const {
  const RowVector rows = A * x;
  return rows - rows.cwiseMax(bounds.row_lower).cwiseMin(bounds.row_upper);
}

double Qp::row_scale(const Vector& x, int k) const {
  double scale = A.row(k).cwiseAbs().dot(x.cwiseAbs().transpose());
  for (const double bound : {bounds.row_lower[k], bounds.row_upper[k]})
    if (std::isfinite(bound)) scale += std::abs(bound);
  return scale;
}

double Qp::row_response(int k) const {
  double response = 0;
  for (int j = 0; j < g.size(); ++j)
    if (H(j, j) > 0) response += std::abs(A(k, j) * g[j]) / H(j, j);
  return response;
}

Qp random_qp(std::mt19937_64& random, int n, Rows rows) {
  const int effectors = std::uniform_int_distribution<int>(1, n)(random);
  const bool singular = chance(random, 0.3);
  Matrix W_ea = normal(random, effectors, n);
  Matrix J = normal(random, n, n + 1 <= kMaxVariables ? n + 1 : n);
  const bool twins = n > 1 && chance(random, 0.3);
  if (twins) {  // the last actuator pulls where the first does
    W_ea.col(n - 1) = W_ea.col(0);
    J.row(n - 1) = J.row(0);
  }
  Vector scale(n);
  for (double& entry : scale) entry = std::pow(10.0, uniform(random, -3, 3));
  W_ea = W_ea * scale.asDiagonal();
  J = scale.asDiagonal() * J;

  Qp qp;
  qp.A = J * J.transpose();
  const Matrix Q = W_ea.transpose() * W_ea;
  const double epsilon = singular ? 0 : 1e-3 * Q.trace() / qp.A.trace();
  qp.H = Q + epsilon * qp.A;
  qp.g = W_ea.transpose() * normal(random, effectors, 1).col(0);

  const Vector unit = scale.cwiseInverse();
  const Vector inside = unit.cwiseProduct(normal(random, n, 1).col(0));
  Vector lower, upper;
  draw_bounds(random, true, singular || twins, inside.cwiseQuotient(unit), lower, upper);
  qp.bounds.lower = lower.cwiseProduct(unit);
  qp.bounds.upper = upper.cwiseProduct(unit);
  const Vector row_unit = qp.A.diagonal().cwiseProduct(unit);
  draw_bounds(random, rows == Rows::kFeasible, false, (qp.A * inside).cwiseQuotient(row_unit), lower, upper);
  qp.bounds.row_lower = lower.cwiseProduct(row_unit);
  qp.bounds.row_upper = upper.cwiseProduct(row_unit);
  return qp;
}

}  // namespace tendril::qp
