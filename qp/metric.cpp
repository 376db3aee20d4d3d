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
  first_row_ = round_up_to_strip(n);
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
  weight_.fill(0);
  unit_.fill(0);
  for (int c = 0; c < 2 * n; ++c) {
    const int k = number(c);
    const double length = M.col(c).norm();
    const double weight = length > 0 ? power_of_two_near(1 / length) : 1.0;
    weight_[k] = weight;
    unit_[k] = 1 / weight;
    if (!(std::isfinite(weight) && std::isfinite(unit_[k]))) return false;
    M.col(c) *= weight;
    const bool by_energy = softness == Softness::kByEnergy && length > 0;
    softness_[k] = c < n ? 0 : by_energy ? kByEnergy * stiffest * weight * weight * A(c - n, c - n) : kEven;
  }
  q_.fill(0);
  gram_.fill(0);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      q_[j * stride() + i] = (i < j ? H(j, i) : H(i, j)) * unit_[i] * unit_[j];
      q_[j * stride() + first_row_ + i] = A(i, j) * weight_[first_row_ + i] * unit_[j];
    }
  }
  for (int c = 0; c < 2 * n; ++c)
    for (int b = 0; b <= c; ++b)
      gram_[number(c) * stride() + number(b)] = gram_[number(b) * stride() + number(c)] =
          M.col(b).dot(M.col(c));
  error_ = measure_error();
  return true;
}

/// What Q makes of the columns of G, next to what it should: the constraint's normal, and its values.
double Metric::measure_error() const {
  double worst = 0, soft = 0;
  for (int k = 0; k < stride(); ++k) {
    Values z{}, product, size;
    std::copy_n(gram(k), n_, z.begin());
    evaluate(z, product, size);
    for (int j = 0; j < n_; ++j) {
      const double normal = k < first_row_ ? (j == k ? 1.0 : 0.0) : q(j)[k];
      worst = std::max(worst, std::abs(product[j] - normal));
      worst = std::max(worst, std::abs(product[first_row_ + j] - gram(k)[first_row_ + j]));
    }
    soft = std::max(soft, softness_[k]);
  }
  return worst + n_ * kRounding + soft;
}

void Metric::evaluate(const Values& z, Values& product, Values& size) const noexcept {
  for (int k = 0; k < stride(); k += kStrip) {
    Strip sum{}, magnitude{};
    for (int j = 0; j < n_; ++j) {
      const Strip term = load(q(j) + k) * z[j];
      sum += term;
      magnitude += abs(term);
    }
    store(product.data() + k, sum);
    store(size.data() + k, magnitude);
  }
}

}  // namespace tendril::qp
