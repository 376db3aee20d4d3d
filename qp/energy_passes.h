// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "qp/refinement.h"

namespace tendril::qp {

/// The passes of a problem of two levels: least objective first, then least energy.
///
/// The method of multipliers for "least energy, with the least objective". γ is shifted by the multipliers of
/// the latter. Each pass reduces the error by the ratio of energy to objective. [Chiche & Gilbert 2016;
/// docs/derivation.md, (D58) and (D59)]
///
/// Real-time, all: yes.
class EnergyPasses {
 public:
  /// Begins a new problem.
  /// @param energy_weight  Problem::energy_weight()
  void begin(double energy_weight) {
    energy_weight_ = energy_weight;
    passes_ = 0;
  }

  /// Whether the candidate is the solution of the least energy. If not, shifts γ by the gradient of the
  /// objective there, so that the next one is nearer.
  /// @param candidate  accepted, with its residuals evaluated
  /// @param term_sum   Σ |γ_j| + Σ |λ_k| there
  bool converged(const Metric& metric, const Refinement& candidate, double term_sum,
                 ScaledProblem& problem) noexcept;

  /// γ before the first pass.
  const Values& gamma(const ScaledProblem& problem) const { return passes_ > 0 ? gamma_ : problem.gamma(); }

 private:
  double energy_weight_ = 0;
  int passes_ = 0;
  alignas(64) Values gamma_{};                   // before the first pass
  alignas(64) Values z_before_{}, Hz_before_{};  // at the last pass; H with its share of the energy
};

}  // namespace tendril::qp
