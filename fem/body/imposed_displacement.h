// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace tendril::fem {

/// Which signs the efforts of cables may have.
enum class EffortSign {
  kPullOnly,   ///< λ ≥ 0: a cable that would push is slack
  kBilateral,  ///< any λ, as of rods
};

/// Largest number of actuators of solve_efforts().
inline constexpr int kMaxEfforts = TENDRIL_MAX_ACTUATORS;

/// Efforts that impose displacements δ_a on the linearised body. With w = W_aa λ + δ_a_free − δ_a, an
/// actuator of any sign reaches its displacement, w_i = 0. One that only pulls is taut and at its
/// displacement, or slack and beyond it (Signorini's conditions):
///   λ_i ≥ 0,   w_i ≥ 0,   λ_i w_i = 0.
///
/// This minimises ½ λᵀW_aa λ + (δ_a_free − δ_a)ᵀλ under the signs. The method is the active-set method of
/// Lawson & Hanson, "Solving Least Squares Problems" (1974), ch. 23, which ends after finitely many steps, on
/// efforts that are scaled to √J. If several actuators do the same, as parallel cables on one point, their
/// efforts are not unique. Steps of the proximal point method [Rockafellar 1976] then keep each problem
/// definite.
/// @param W_aa          m × m, symmetric positive semidefinite, m/N, m³/Pa and mixtures
/// @param delta_a_free  m, m or m³
/// @param delta_a       imposed displacements, m, m or m³
/// @param pull_only     m
/// @param lambda        result, m, N or Pa; also the first guess
/// @return  false if no efforts are found: W_aa is not finite or not semidefinite, an actuator moves nothing,
///          or actuators that do the same have different displacements; λ is then of no use
/// @throws  std::invalid_argument if m is more than kMaxEfforts
/// Real-time: no (time depends on how many efforts change sign); allocates nothing.
[[nodiscard]] bool solve_efforts(const Eigen::MatrixXd& W_aa, const Eigen::VectorXd& delta_a_free,
                                 const Eigen::VectorXd& delta_a, const Eigen::ArrayX<bool>& pull_only,
                                 Eigen::VectorXd& lambda);

}  // namespace tendril::fem
