#pragma once

#include <Eigen/Core>

namespace tendril::fem {

/// Whether actuators that only pull may push.
enum class EffortSign {
  kPullOnly,   ///< λ ≥ 0 of cables: one that would push goes slack
  kBilateral,  ///< any λ, as if cables were rods
};

/// Largest number of efforts that solve_efforts() looks for.
inline constexpr int kMaxEfforts = 32;

/// Efforts that impose displacements on a linearised body. Those that may have any sign reach theirs,
///   w_i = 0  where  w = W_aa λ + δ_a_free − δ_a,
/// and those that only pull obey Signorini's conditions: taut and at the imposed displacement, or slack and
/// beyond it,
///   λ_i ≥ 0,   w_i ≥ 0,   λ_i w_i = 0.
/// That is what minimises ½ λᵀW_aa λ + (δ_a_free − δ_a)ᵀλ, and is found by the active-set method of Lawson &
/// Hanson, "Solving Least Squares Problems" (1974), ch. 23, which ends after finitely many steps. Actuators
/// of different units are scaled to √J. Where several do the same, as parallel cables on one point, their
/// efforts are not unique; steps of the proximal point method [Rockafellar 1976] make each problem definite.
/// @param W_aa          m × m, symmetric positive semidefinite, m/N, m³/Pa and mixtures
/// @param delta_a_free  m, m or m³
/// @param delta_a       m imposed displacements, m or m³
/// @param pull_only     m
/// @param lambda        m, N or Pa; result, and a guess to start from
/// @return  false if no efforts were found: W_aa is not finite or not semidefinite, an actuator moves
/// nothing,
///          or actuators that do the same are asked for different displacements; λ is then of no use
/// @throws  std::invalid_argument if m is more than kMaxEfforts
/// Real-time: no (time depends on how many efforts change sign); allocates nothing.
[[nodiscard]] bool solve_efforts(const Eigen::MatrixXd& W_aa, const Eigen::VectorXd& delta_a_free,
                                 const Eigen::VectorXd& delta_a, const Eigen::ArrayX<bool>& pull_only,
                                 Eigen::VectorXd& lambda);

}  // namespace tendril::fem
