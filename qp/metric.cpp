// SPDX-License-Identifier: Apache-2.0
#include "qp/metric.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tendril::qp {
namespace {

// Dependent constraints leave pivots of this size, which must be well above the rounding of G, 1e-16 a term.
// The first candidate misses a row that can be met by this times the row's multiplier.
constexpr double kUniformSoftness = 1e-12;
constexpr double kMaxSoftness = 1e-6;  // of the softest row, by compliance

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

bool Metric::build(const ProblemData& data, const Matrix& L, const Vector& d, Softness softness) noexcept {
  const RowMatrix& A = data.A;
  const int n = n_ = static_cast<int>(d.size()), rows = rows_ = static_cast<int>(A.rows());
  first_row_ = round_up_to_simd(n);
  stride_ = (first_row_ + rows + 2 * kSimdRows - 1) / (2 * kSimdRows) * (2 * kSimdRows);
  first_energy_row_ = data.E ? stride_ : first_row_;
  q_stride_ = data.E ? stride_ + first_row_ : stride_;
  const RowMatrix AD = A * d.asDiagonal();
  Normals M(n, n + rows);
  M.leftCols(n) = d.asDiagonal();
  M.rightCols(rows) = AD.transpose();
  solve_lower(L, M);

  // δ_k = factor ω_k² c_k. The stiffest row for its compliance sets the factor, so that no row is softer than
  // kMaxSoftness (‖D H D‖ ≤ n).
  double stiffest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < rows; ++k)
    if (data.compliance[k] > 0)
      stiffest = std::min(stiffest, AD.row(k).squaredNorm() / (n * data.compliance[k]));
  weight_.fill(0);
  unit_.fill(0);
  softness_.fill(0);
  for (int c = 0; c < n + rows; ++c) {
    const int k = number(c);
    const double length = M.col(c).norm();
    const double weight = length > 0 ? power_of_two_near(1 / length) : 1.0;
    weight_[k] = weight;
    unit_[k] = 1 / weight;
    if (!(std::isfinite(weight) && std::isfinite(unit_[k]))) return false;
    M.col(c) *= weight;
    const bool by_compliance = softness == Softness::kByCompliance && length > 0;
    if (c >= n)
      softness_[k] = by_compliance ? kMaxSoftness * stiffest * weight * weight * data.compliance[c - n]
                                   : kUniformSoftness;
  }
  gram_.fill(0);
  for (int c = 0; c < n + rows; ++c)
    for (int b = 0; b <= c; ++b)
      gram_[number(c) * stride_ + number(b)] = gram_[number(b) * stride_ + number(c)] =
          M.col(b).dot(M.col(c));
  fill_q(data);
  error_ = measure_error();
  return true;
}

void Metric::fill_q(const ProblemData& data) {
  q_.fill(0);
  for (int j = 0; j < n_; ++j) {
    double* column = q_.data() + j * q_stride_;
    for (int i = 0; i < n_; ++i) column[i] = (i < j ? data.H(j, i) : data.H(i, j)) * unit_[i] * unit_[j];
    for (int i = 0; i < rows_; ++i)
      column[first_row_ + i] = data.A(i, j) * weight_[first_row_ + i] * unit_[j];
    if (!data.E) continue;
    for (int i = 0; i < n_; ++i) column[stride_ + i] = (*data.E)(i, j) * unit_[j];
  }
  if (data.E) std::fill_n(&weight_[stride_], n_, 1), std::fill_n(&unit_[stride_], n_, 1);
}

/// The largest error of Q times a column of G, which should be the constraint's normal and its values.
double Metric::measure_error() const {
  double worst = 0, soft = 0;
  for (int k = 0; k < stride_; ++k) {
    Values z{}, product, size;
    std::copy_n(gram(k), n_, z.begin());
    evaluate(z, product, size);
    for (int j = 0; j < n_; ++j) {
      const double normal = k < first_row_ ? (j == k ? 1.0 : 0.0) : q(j)[k];
      worst = std::max(worst, std::abs(product[j] - normal));
    }
    for (int i = first_row_; i < first_row_ + rows_; ++i)
      worst = std::max(worst, std::abs(product[i] - gram(k)[i]));
    soft = std::max(soft, softness_[k]);
  }
  return worst + n_ * kRounding + soft;
}

void Metric::evaluate(const Values& z, Values& product, Values& size) const noexcept {
  for (int k = 0; k < q_stride_; k += kSimdRows) {
    Simd sum{}, magnitude{};
    for (int j = 0; j < n_; ++j) {
      const Simd term = load(q(j) + k) * z[j];
      sum += term;
      magnitude += abs(term);
    }
    store(product.data() + k, sum);
    store(size.data() + k, magnitude);
  }
}

}  // namespace tendril::qp
