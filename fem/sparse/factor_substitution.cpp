// SPDX-License-Identifier: Apache-2.0
// Substitution with the factor L.

#include <algorithm>

#include "fem/sparse/factor.h"

namespace tendril::fem {
namespace {

constexpr int kNoBorder = -8;  // no row of the border is among the eight from here on

}  // namespace

void Factor::solve(const Eigen::VectorXd& c, Eigen::VectorXd& x) {
  double* z = z_.get();
  for (auto layout = fronts_.rbegin(); layout != fronts_.rend(); ++layout) {
    const Front f = front(*layout);
    double* at = z;
    for (const int node : layout->rows) at = std::copy_n(x.data() + 3 * node, 3, at);
    for (const int row : layout->border) *at++ = -c[row];  // L₁ᵀ x = Y c − L₂ᵀ x
    std::fill(at, z + round_up_to_panel(f.n), 0.0);
    double* solution = z + round_up_to_panel(f.n);
    kernels_.back_substitute(f, z, solution);
    for (const int node : layout->pivots) {
      std::copy_n(solution, 3, x.data() + 3 * node);
      solution += 3;
    }
  }
}

/// Above the diagonal of the pivots nothing is stored.
void Factor::store_single(const FrontLayout& layout, const double* L) {
  float* single = L1_.get() + layout.L;
  const size_t stride = static_cast<size_t>(kSimdRows) * layout.k;
  const int pivot_panels = round_up_to_panel(layout.k) / kSimdRows;
  const int panels = pivot_panels + round_up_to_panel(layout.n) / kSimdRows;
  for (int s = 0; s < panels; ++s) {
    const int columns = s < pivot_panels ? std::min(layout.k, kSimdRows * (s + 1)) : layout.k;
    std::transform(L + s * stride, L + s * stride + kSimdRows * columns, single + s * stride,
                   [](double number) { return static_cast<float>(number); });
  }
}

void Factor::precondition(EightVectors& V) {
  Eigen::Map<Eigen::Matrix<float, 8, Eigen::Dynamic>> x(x1_.get(), 8, V.cols());
  x = V.cast<float>();
  forward_substitute_eight();
  backward_substitute_eight(kNoBorder);
  V = x.cast<double>();
}

void Factor::border_solutions(int first, EightVectors& X) {
  Eigen::Map<Eigen::Matrix<float, 8, Eigen::Dynamic>> x(x1_.get(), 8, X.cols());
  x.setZero();
  backward_substitute_eight(first);
  X = x.cast<double>();
}

void Factor::forward_substitute_eight() {
  float *x = x1_.get(), *z = front1_.get();
  for (const FrontLayout& layout : fronts_) {
    float* at = z;
    for (const int node : layout.pivots) at = std::copy_n(x + 24 * node, 24, at);
    float* update = z + 8 * round_up_to_panel(layout.k);
    std::fill(at, update, 0.0f);
    kernels_.forward_substitute_eight(L1_.get() + layout.L, layout.k, layout.n, z);
    at = z;
    for (const int node : layout.pivots) {
      std::copy_n(at, 24, x + 24 * node);
      at += 24;
    }
    for (const int node : layout.rows)
      for (int c = 0; c < 24; ++c) x[24 * node + c] += *update++;
  }
}

/// @param first  row of the border whose solution the first of the eight vectors is
void Factor::backward_substitute_eight(int first) {
  float *x = x1_.get(), *z = front1_.get();
  for (auto layout = fronts_.rbegin(); layout != fronts_.rend(); ++layout) {
    float* at = z;
    for (const int node : layout->pivots) at = std::copy_n(x + 24 * node, 24, at);
    float* update = z + 8 * round_up_to_panel(layout->k);
    std::fill(at, update, 0.0f);
    for (const int node : layout->rows) update = std::copy_n(x + 24 * node, 24, update);
    for (const int row : layout->border)
      for (int lane = 0; lane < 8; ++lane) *update++ = row == first + lane ? -1.0f : 0.0f;
    std::fill(update, z + 8 * (round_up_to_panel(layout->k) + round_up_to_panel(layout->n)), 0.0f);
    kernels_.backward_substitute_eight(L1_.get() + layout->L, layout->k, layout->n, z);
    at = z;
    for (const int node : layout->pivots) {
      std::copy_n(at, 24, x + 24 * node);
      at += 24;
    }
  }
}

}  // namespace tendril::fem
