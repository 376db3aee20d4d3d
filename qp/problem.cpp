// SPDX-License-Identifier: Apache-2.0
#include "qp/problem.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

namespace tendril::qp {
namespace {

// Relative to a unit diagonal. H is factored without a proximal term if its pivots are above kMinPivot. With
// smaller pivots, rounding errors in H⁻¹ would decide which constraints are active.
constexpr double kMinPivot = 1e-8;
constexpr double kProximal = 1e-6;
// Share of the energy in the working Hessian of two levels, relative to H's diagonal where it is least. A
// small one needs fewer passes. If the pivots are below kMinEnergyPivot then, the large one is taken, and E
// made regular until they are kProximal: with smaller ones, rounding decides which constraints of similar
// actuators are active.
constexpr double kEnergyShare = 1e-7, kLargeEnergyShare = 1e-4;
constexpr double kMinEnergyPivot = 5e-8;
constexpr double kAsymmetry = 1e-8;
// A variable with a smaller diagonal entry of H, relative to its energy, is scaled by its energy.
constexpr double kMinColumnScale = 1e-6;

Preparation check_semidefinite(const Matrix& S) {
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
Vector variable_scales(const Matrix& H, const Matrix& E) {
  // H_jj λ² is an area, E_jj λ² an energy whatever the actuator's kind: their ratios compare.
  double per_energy = 0;
  for (int j = 0; j < H.rows(); ++j)
    if (E(j, j) > 0) per_energy = std::max(per_energy, H(j, j) / E(j, j));
  Vector d(H.rows());
  for (int j = 0; j < H.rows(); ++j) {
    double size = std::max(H(j, j), kMinColumnScale * per_energy * E(j, j));
    if (size <= 0) size = E(j, j) > 0 ? E(j, j) : H.diagonal().maxCoeff();
    d[j] = power_of_two_near(size > 0 ? 1 / std::sqrt(size) : 1.0);
  }
  return d;
}

/// η that makes η E about `share` of H on the diagonal, at the variable where this share is least.
double weight_of_energy(const Matrix& E, const Vector& d, double share) {
  double least = std::numeric_limits<double>::infinity();
  for (int j = 0; j < d.size(); ++j)
    if (E(j, j) > 0) least = std::min(least, d[j] * d[j] * E(j, j));
  return share / least;
}

/// Lower Cholesky factor of S + μ I in place of S's lower triangle; the smallest pivot.
double factorize(Matrix& S, double mu) {
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

Preparation finite(const Matrix& L) { return L.allFinite() ? Preparation::kReady : Preparation::kNotFinite; }

}  // namespace

const char* name(Preparation preparation) noexcept {
  switch (preparation) {
    case Preparation::kReady:
      return "ready";
    case Preparation::kBadSize:
      return "H and E must be square, of one size, 1 to 32, and A must have as many columns and 0 to 64 rows";
    case Preparation::kNotFinite:
      return "H, E or A is not finite, or its entries are too far apart to scale";
    case Preparation::kNotSymmetric:
      return "H or E is not symmetric";
    case Preparation::kIndefinite:
      return "H or E is not positive semidefinite, or the compliance of a row is not positive";
  }
  return "unknown";
}

Preparation Problem::prepare(const Matrix& H, const Matrix& W_aa, TieBreak tie_break) noexcept {
  return prepare(H, W_aa, W_aa, W_aa.diagonal(), tie_break);
}

Preparation Problem::prepare(const Matrix& H, const Matrix& E, const RowMatrix& A,
                             const RowVector& compliance, TieBreak tie_break) noexcept {
  n_ = 0;
  const auto n = H.rows(), rows = A.rows();
  if (n < 1 || H.cols() != n || E.rows() != n || E.cols() != n || A.cols() != n || compliance.size() != rows)
    return Preparation::kBadSize;
  for (const Matrix* S : {&H, &E})
    if (const Preparation found = check_semidefinite(*S); found != Preparation::kReady) return found;
  if (!A.allFinite() || !compliance.allFinite()) return Preparation::kNotFinite;
  for (int k = 0; k < rows; ++k)
    if (!(compliance[k] > 0) && !A.row(k).isZero(0)) return Preparation::kIndefinite;

  const Vector d = variable_scales(H, E);
  if (!(A * d.asDiagonal()).allFinite()) return Preparation::kNotFinite;
  Matrix L, working = H, energy = E;
  const Preparation factored = tie_break == TieBreak::kLeastEnergy
                                   ? factorize_two_levels(d, working, energy, L)
                                   : factorize_one_level(H, d, L);
  if (factored != Preparation::kReady) return factored;
  const bool energy_in_rows = energy_weight_ == 0 || (rows >= n && A.topRows(n) == energy);
  if (!objective_metric_.build({working, A, compliance, energy_in_rows ? nullptr : &energy}, L, d,
                               Metric::Softness::kUniform))
    return Preparation::kNotFinite;
  L.setIdentity();
  const Matrix D_squared_inverse = d.cwiseAbs2().cwiseInverse().asDiagonal();
  if (!violation_metric_.build({D_squared_inverse, A, compliance}, L, d, Metric::Softness::kByCompliance))
    return Preparation::kNotFinite;

  static std::atomic<uint64_t> count{0};
  id_ = count.fetch_add(1, std::memory_order_relaxed) + 1;
  n_ = static_cast<int>(n);
  return Preparation::kReady;
}

/// @param L  result: factor of D H D, with a proximal term where H is nearly singular
Preparation Problem::factorize_one_level(const Matrix& H, const Vector& d, Matrix& L) {
  energy_weight_ = 0;
  const Matrix S = d.asDiagonal() * H * d.asDiagonal();
  if (!S.allFinite()) return Preparation::kNotFinite;
  L = S;
  proximal_ = factorize(L, 0) < kMinPivot;
  if (!proximal_) return Preparation::kReady;
  L = S;
  return factorize(L, kProximal) < kProximal / 2 ? Preparation::kIndefinite : Preparation::kReady;
}

/// @param H  replaced by H + η E
/// @param E  made regular where that is needed
/// @param L  result: factor of D H D
Preparation Problem::factorize_two_levels(const Vector& d, Matrix& H, Matrix& E, Matrix& L) {
  if (E.isZero(0)) return factorize_one_level(H, d, L);
  proximal_ = false;
  const Matrix objective = H;
  const auto factorize_with = [&](double share) {
    energy_weight_ = weight_of_energy(E, d, share);
    H = objective + energy_weight_ * E;
    L = d.asDiagonal() * H * d.asDiagonal();
    return factorize(L, 0);
  };
  if (factorize_with(kEnergyShare) >= kMinEnergyPivot) return finite(L);
  const double pivot = factorize_with(kLargeEnergyShare);
  if (pivot >= kProximal) return finite(L);
  // A multiple of the identity raises every pivot by itself, at least: the term sets in continuously.
  const double mu = kProximal - std::max(pivot, 0.0);
  const Vector D_squared_inverse = d.cwiseAbs2().cwiseInverse();
  E.diagonal() += mu / energy_weight_ * D_squared_inverse;
  H.diagonal() += mu * D_squared_inverse;
  L = d.asDiagonal() * H * d.asDiagonal();
  if (!L.allFinite()) return Preparation::kNotFinite;
  return factorize(L, 0) < kProximal / 2 ? Preparation::kIndefinite : Preparation::kReady;
}

}  // namespace tendril::qp
