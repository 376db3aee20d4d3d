// SPDX-License-Identifier: Apache-2.0
#include "qp/energy_passes.h"

#include <algorithm>

namespace tendril::qp {
namespace {

// Last change of a solution, in the norm of the working Hessian and relative to itself.
constexpr double kPassAccuracy = 1e-7;
constexpr int kMaxPasses = 12;  // two to six are usual

}  // namespace

bool EnergyPasses::converged(const Metric& metric, const Refinement& candidate, double term_sum,
                             ScaledProblem& problem) noexcept {
  const Values &z = candidate.z(), &Qz = candidate.Qz();
  const int n = problem.n();
  if (passes_ == 0) {
    std::copy_n(problem.gamma().begin(), n, gamma_.begin());
  } else {
    double change = 0, norm = 0;
    for (int j = 0; j < n; ++j) {
      change += (z[j] - z_before_[j]) * (Qz[j] - Hz_before_[j]);
      norm += z[j] * Qz[j];
    }
    const double rounding = n * kRounding * term_sum;  // of z, also where it is zero
    if (change <= kPassAccuracy * kPassAccuracy * norm + rounding * rounding || passes_ == kMaxPasses)
      return true;
  }
  ++passes_;
  std::copy_n(z.begin(), n, z_before_.begin());
  std::copy_n(Qz.begin(), n, Hz_before_.begin());
  Values gradient;
  for (int j = 0; j < n; ++j) {
    const int k = metric.first_energy_row() + j;
    const double energy = energy_weight_ * Qz[k] * metric.unit(k) * metric.unit(j);
    gradient[j] = Qz[j] - energy + gamma_[j];
  }
  problem.add_to_gamma(metric, gradient);
  return false;
}

}  // namespace tendril::qp
