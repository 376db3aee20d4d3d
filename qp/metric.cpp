#include "qp/metric.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tendril::qp {
namespace {

// Dependent constraints leave pivots of this size, which must stand out from the rounding of G, 1e-16 a term;
// rows that can be met are first off by this times their multiplier.
constexpr double kEven = 1e-12;
constexpr double kByEnergy = 1e-6;  // of the softest row

/// Constraint normals in the metric of H⁻¹, one a column: G = MᵀM.
using Normals = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxVariables, kMaxConstraints>;

void solve_lower(const Matrix& L, Normals& M) {
  for (int c = 0; c < M.cols(); ++c) {
    for (int j = 0; j < L.cols(); ++j) {
      M(j, c) /= L(j, j);
      for (int i = j + 1; i < L.rows(); ++i) M(i, c) -= L(i, j) * M(j, c);
    }
  }
}

}  // namespace

double power_of_two_near(double value) noexcept { return std::exp2(std::round(std::log2(value))); }

bool Metric::build(const Matrix& H, const Matrix& L, const Matrix& A, const Vector& d,
                   Softness softness) noexcept {
  const int n = n_ = static_cast<int>(d.size());
  stride_ = (2 * n + 3) / 4 * 4;
  const Matrix AD = A * d.asDiagonal();
  Normals M(n, 2 * n);
  M.leftCols(n) = d.asDiagonal();
  M.rightCols(n) = AD.transpose();
  solve_lower(L, M);

  // The factor that δ_k and A_kk have in common is set by the row that is stiffest for its A_kk, so that none
  // is softer than it was meant to be (‖D H D‖ ≤ n).
  double stiffest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < n; ++k)
    if (A(k, k) > 0) stiffest = std::min(stiffest, AD.row(k).squaredNorm() / (n * A(k, k)));
  for (int k = 0; k < 2 * n; ++k) {
    const double length = M.col(k).norm();
    const double weight = length > 0 ? power_of_two_near(1 / length) : 1.0;
    weight_[k] = weight;
    unit_[k] = 1 / weight;
    if (!(std::isfinite(weight) && std::isfinite(unit_[k]))) return false;
    M.col(k) *= weight;
    const bool by_energy = softness == Softness::kByEnergy && length > 0;
    softness_[k] = k < n ? 0 : by_energy ? kByEnergy * stiffest * weight * weight * A(k - n, k - n) : kEven;
  }
  q_.fill(0);
  gram_.fill(0);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      q_[j * stride_ + i] = (i < j ? H(j, i) : H(i, j)) * unit_[i] * unit_[j];
      q_[j * stride_ + n + i] = A(i, j) * weight_[n + i] * unit_[j];
    }
  }
  for (int k = 0; k < 2 * n; ++k)
    for (int i = 0; i <= k; ++i) gram_[k * stride_ + i] = gram_[i * stride_ + k] = M.col(i).dot(M.col(k));
  return true;
}

void Metric::evaluate(const Values& z, Values& product, Values& size) const noexcept {
  std::fill_n(product.begin(), stride_, 0.0);
  std::fill_n(size.begin(), stride_, 0.0);
  for (int j = 0; j < n_; ++j) {
    const double* column = q(j);
    for (int k = 0; k < stride_; ++k) {
      product[k] += column[k] * z[j];
      size[k] += std::abs(column[k] * z[j]);
    }
  }
}

}  // namespace tendril::qp
