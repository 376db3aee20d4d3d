#include "qp/problem.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

namespace tendril::qp {
namespace {

// Relative to a unit diagonal. H is factored as it is while its pivots stay above kPivot; below, what
// rounding leaves of H⁻¹ would decide which constraints are active.
constexpr double kPivot = 1e-8;
constexpr double kProximal = 1e-6;
// Of the energy in the working problem of two levels, relative to H's diagonal where it is least.
constexpr double kEnergy = 1e-7;
constexpr double kAsymmetry = 1e-8;
// A column of H this much smaller than its actuator's own compliance suggests is scaled by the compliance.
constexpr double kFaint = 1e-6;

Preparation check(const Matrix& S) {
  const auto n = S.rows();
  if (!S.allFinite()) return Preparation::kNotFinite;
  for (int j = 0; j < n; ++j) {
    if (S(j, j) < 0) return Preparation::kIndefinite;
    for (int i = 0; i < j; ++i) {
      const double size = std::sqrt(S(i, i)) * std::sqrt(S(j, j));
      if (std::abs(S(i, j) - S(j, i)) > kAsymmetry * size) return Preparation::kNotSymmetric;
      if (std::abs(S(i, j)) > size * (1 + kAsymmetry)) return Preparation::kIndefinite;
    }
  }
  return Preparation::kReady;
}

/// Scales of x that bring the diagonal of H to about one, also where a variable hardly enters H.
Vector scales(const Matrix& H, const Matrix& A) {
  // H_jj λ² is an area, A_jj λ² an energy whatever the actuator's kind: their ratios compare.
  double per_energy = 0;
  for (int j = 0; j < H.rows(); ++j)
    if (A(j, j) > 0) per_energy = std::max(per_energy, H(j, j) / A(j, j));
  Vector d(H.rows());
  for (int j = 0; j < H.rows(); ++j) {
    double size = std::max(H(j, j), kFaint * per_energy * A(j, j));
    if (size <= 0) size = A(j, j) > 0 ? A(j, j) : H.diagonal().maxCoeff();
    d[j] = power_of_two_near(size > 0 ? 1 / std::sqrt(size) : 1.0);
  }
  return d;
}

/// Lower Cholesky factor of S + μ I in place of S's lower triangle; the smallest pivot.
double factor(Matrix& S, double mu) {
  double smallest = std::numeric_limits<double>::infinity();
  for (int j = 0; j < S.cols(); ++j) {
    double pivot = S(j, j) + mu;
    for (int k = 0; k < j; ++k) pivot -= S(j, k) * S(j, k);
    if (!(pivot > 0)) return pivot;
    smallest = std::min(smallest, pivot);
    S(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < S.rows(); ++i) {
      double value = S(i, j);
      for (int k = 0; k < j; ++k) value -= S(i, k) * S(j, k);
      S(i, j) = value / S(j, j);
    }
  }
  return smallest;
}

}  // namespace

const char* name(Preparation preparation) noexcept {
  switch (preparation) {
    case Preparation::kReady:
      return "ready";
    case Preparation::kBadSize:
      return "H and A must be square, of one size, 1 to 32";
    case Preparation::kNotFinite:
      return "H or A is not finite, or its entries are too far apart to scale";
    case Preparation::kNotSymmetric:
      return "H or A is not symmetric";
    case Preparation::kIndefinite:
      return "H or A is not positive semidefinite";
  }
  return "unknown";
}

Preparation Problem::prepare(const Matrix& H, const Matrix& A, Ties ties) noexcept {
  n_ = 0;
  const int n = static_cast<int>(H.rows());
  if (n < 1 || H.cols() != n || A.rows() != n || A.cols() != n) return Preparation::kBadSize;
  for (const Matrix* S : {&H, &A})
    if (const Preparation found = check(*S); found != Preparation::kReady) return found;

  const Vector d = scales(H, A);
  double least_energy = std::numeric_limits<double>::infinity();  // of a variable as large as D makes it
  for (int j = 0; j < n; ++j)
    if (A(j, j) > 0) least_energy = std::min(least_energy, d[j] * d[j] * A(j, j));
  energy_weight_ = ties == Ties::kLeastEnergy ? kEnergy / least_energy : 0;
  const Matrix working = H + energy_weight_ * A;
  const Matrix S = d.asDiagonal() * working * d.asDiagonal();
  if (!S.allFinite() || !(A * d.asDiagonal()).allFinite()) return Preparation::kNotFinite;
  Matrix L = S;
  proximal_ = factor(L, 0) < kPivot;
  if (proximal_) {
    L = S;
    if (factor(L, kProximal) < kProximal / 2) return Preparation::kIndefinite;
  }
  if (!optimum_.build(working, L, A, d, Metric::Softness::kEven)) return Preparation::kNotFinite;
  L.setIdentity();
  if (!least_.build(d.cwiseAbs2().cwiseInverse().asDiagonal(), L, A, d, Metric::Softness::kByEnergy))
    return Preparation::kNotFinite;

  static std::atomic<std::uint64_t> count{0};
  id_ = count.fetch_add(1, std::memory_order_relaxed) + 1;
  n_ = n;
  return Preparation::kReady;
}

}  // namespace tendril::qp
