// What a Factor does with L once it is there.

#include <algorithm>

#include "fem/sparse/factor.h"

namespace tendril::fem {
namespace {

constexpr int kNoBorder = -8;  // the eight rows from here on are none of the border's

}  // namespace

void Factor::solve(const Eigen::VectorXd& c, Eigen::VectorXd& x) {
  double* z = z_.get();
  for (auto place = fronts_.rbegin(); place != fronts_.rend(); ++place) {
    const Front f = front(*place);
    double* at = z;
    for (const int node : place->rows) at = std::copy_n(x.data() + 3 * node, 3, at);
    for (const int row : place->border) *at++ = -c[row];  // L₁ᵀ x = Y c − L₂ᵀ x
    std::fill(at, z + round_up_to_strip(f.n), 0.0);
    double* solution = z + round_up_to_strip(f.n);
    kernels_.back_substitute(f, z, solution);
    for (const int node : place->pivots) {
      std::copy_n(solution, 3, x.data() + 3 * node);
      solution += 3;
    }
  }
}

/// Above the diagonal of the pivots L has never been written.
void Factor::keep_single(const Place& place, const double* L) {
  float* kept = L1_.get() + place.L;
  const size_t stride = static_cast<size_t>(kStrip) * place.k;
  const int pivot_strips = round_up_to_strip(place.k) / kStrip;
  const int strips = pivot_strips + round_up_to_strip(place.n) / kStrip;
  for (int s = 0; s < strips; ++s) {
    const int columns = s < pivot_strips ? std::min(place.k, kStrip * (s + 1)) : place.k;
    std::transform(L + s * stride, L + s * stride + kStrip * columns, kept + s * stride,
                   [](double number) { return static_cast<float>(number); });
  }
}

void Factor::precondition(EightVectors& V) {
  Eigen::Map<Eigen::Matrix<float, 8, Eigen::Dynamic>> x(x1_.get(), 8, V.cols());
  x = V.cast<float>();
  forward_eight();
  backward_eight(kNoBorder);
  V = x.cast<double>();
}

void Factor::border_solutions(int first, EightVectors& X) {
  Eigen::Map<Eigen::Matrix<float, 8, Eigen::Dynamic>> x(x1_.get(), 8, X.cols());
  x.setZero();
  backward_eight(first);
  X = x.cast<double>();
}

void Factor::forward_eight() {
  float *x = x1_.get(), *z = front1_.get();
  for (const Place& place : fronts_) {
    float* at = z;
    for (const int node : place.pivots) at = std::copy_n(x + 24 * node, 24, at);
    float* stay = z + 8 * round_up_to_strip(place.k);
    std::fill(at, stay, 0.0f);
    kernels_.forward_eight(L1_.get() + place.L, place.k, place.n, z);
    at = z;
    for (const int node : place.pivots) {
      std::copy_n(at, 24, x + 24 * node);
      at += 24;
    }
    for (const int node : place.rows)
      for (int c = 0; c < 24; ++c) x[24 * node + c] += *stay++;
  }
}

/// @param first  row of the border that the first of the eight vectors is the solution for
void Factor::backward_eight(int first) {
  float *x = x1_.get(), *z = front1_.get();
  for (auto place = fronts_.rbegin(); place != fronts_.rend(); ++place) {
    float* at = z;
    for (const int node : place->pivots) at = std::copy_n(x + 24 * node, 24, at);
    float* stay = z + 8 * round_up_to_strip(place->k);
    std::fill(at, stay, 0.0f);
    for (const int node : place->rows) stay = std::copy_n(x + 24 * node, 24, stay);
    for (const int row : place->border)
      for (int lane = 0; lane < 8; ++lane) *stay++ = row == first + lane ? -1.0f : 0.0f;
    std::fill(stay, z + 8 * (round_up_to_strip(place->k) + round_up_to_strip(place->n)), 0.0f);
    kernels_.backward_eight(L1_.get() + place->L, place->k, place->n, z);
    at = z;
    for (const int node : place->pivots) {
      std::copy_n(at, 24, x + 24 * node);
      at += 24;
    }
  }
}

}  // namespace tendril::fem
