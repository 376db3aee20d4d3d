// SPDX-License-Identifier: Apache-2.0
#include "fem/body/imposed_displacement.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <stdexcept>

namespace tendril::fem {
namespace {

// Proximal term of the scaled problem, whose W has ones on its diagonal: above the rounding errors of W, and
// far below the differences between distinct actuators.
constexpr double kProximal = 1e-9;
constexpr int kProximalSteps = 12;            // definite problems take two
constexpr int kActiveSetStepsPerEffort = 50;  // random problems take at most two
constexpr double kAccuracy = 1e-10;           // of w, relative to the largest gap
constexpr double kWRounding = 1e-13;          // of w, relative to the largest effort

using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxEfforts, 1>;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxEfforts, kMaxEfforts>;
using Flags = Eigen::Array<bool, Eigen::Dynamic, 1, 0, kMaxEfforts, 1>;

/// min ½ λᵀWλ + qᵀλ, λ ≥ 0 where pull_only.
struct Problem {
  Matrix W;  // its lower triangle is used
  Vector q;
  Flags pull_only;

  Eigen::Index size() const { return q.size(); }
  Vector gradient(const Vector& lambda) const { return W.selfadjointView<Eigen::Lower>() * lambda + q; }

  /// Largest violation of Signorini's conditions.
  double residual(const Vector& lambda) const {
    const Vector w = gradient(lambda);
    double largest = 0;
    for (int i = 0; i < size(); ++i)
      largest = std::max(largest, std::abs(pull_only[i] ? std::min(lambda[i], w[i]) : w[i]));
    return largest;
  }
  double rounding(const Vector& lambda) const { return kWRounding * lambda.lpNorm<Eigen::Infinity>(); }
};

/// Minimum over the free efforts, the others zero.
/// @return  false if W is not positive definite over them
bool minimise_over(const Problem& problem, const Flags& free, Vector& z) {
  std::array<int, kMaxEfforts> indices;
  int n = 0;
  for (int i = 0; i < problem.size(); ++i)
    if (free[i]) indices[n++] = i;
  Matrix W(n, n);
  Vector solution(n);
  for (int i = 0; i < n; ++i) {
    solution[i] = -problem.q[indices[i]];
    for (int j = 0; j <= i; ++j) W(i, j) = problem.W(indices[i], indices[j]);
  }
  const Eigen::LLT<Eigen::Ref<Matrix>> llt(W);
  if (llt.info() != Eigen::Success) return false;
  llt.solveInPlace(solution);
  z.setZero(problem.size());
  for (int i = 0; i < n; ++i) z[indices[i]] = solution[i];
  return z.allFinite();
}

/// Lawson and Hanson's method, from any λ of the right signs. Each λ is the minimum over its active set. No
/// set repeats, because the minimum decreases.
/// @return  false if W is not positive definite
bool minimise(const Problem& problem, Vector& lambda) {
  Flags free = !problem.pull_only || lambda.array() > 0;
  Vector z(problem.size());
  for (Eigen::Index step = 0; step < kActiveSetStepsPerEffort * problem.size(); ++step) {
    if (!minimise_over(problem, free, z)) return false;
    double share = 1;  // of the step to z that all signs allow
    int blocking = -1;
    for (int i = 0; i < problem.size(); ++i)
      if (free[i] && problem.pull_only[i] && z[i] <= 0)
        if (const double allowed = lambda[i] > 0 ? lambda[i] / (lambda[i] - z[i]) : 0; allowed < share) {
          share = allowed;
          blocking = i;
        }
    lambda += share * (z - lambda);
    if (blocking >= 0) {
      lambda[blocking] = 0;
      free[blocking] = false;
      continue;
    }
    int entering = -1;
    double least = -problem.rounding(lambda);
    const Vector w = problem.gradient(lambda);
    for (int i = 0; i < problem.size(); ++i)
      if (!free[i] && w[i] < least) least = w[entering = i];
    if (entering < 0) return true;
    free[entering] = true;
  }
  return true;  // within rounding errors sets may repeat; the caller checks λ
}

}  // namespace

bool solve_efforts(const Eigen::MatrixXd& W_aa, const Eigen::VectorXd& delta_a_free,
                   const Eigen::VectorXd& delta_a, const Eigen::ArrayX<bool>& pull_only,
                   Eigen::VectorXd& lambda) {
  if (delta_a.size() > kMaxEfforts)
    throw std::invalid_argument(
        fmt::format("there are {} actuators, expected at most {}", delta_a.size(), kMaxEfforts));
  const Vector gap = delta_a_free - delta_a;
  if (!W_aa.allFinite() || !gap.allFinite() || (W_aa.diagonal().array() <= 0).any()) return false;
  const Vector scale = W_aa.diagonal().cwiseSqrt().cwiseInverse();
  const Problem problem{scale.asDiagonal() * W_aa * scale.asDiagonal(), scale.cwiseProduct(gap), pull_only};

  Vector scaled = lambda.cwiseQuotient(scale);
  if (!scaled.allFinite()) scaled.setZero();
  scaled = pull_only.select(scaled.cwiseMax(0.0), scaled);
  Problem definite = problem;
  definite.W.diagonal().array() += kProximal;
  for (int round = 0; round < kProximalSteps; ++round) {
    definite.q = problem.q - kProximal * scaled;
    if (!minimise(definite, scaled)) return false;
    lambda = scale.cwiseProduct(scaled);
    const double allowed = kAccuracy * problem.q.lpNorm<Eigen::Infinity>() + problem.rounding(scaled);
    if (problem.residual(scaled) <= allowed) return true;
  }
  return false;
}

}  // namespace tendril::fem
