#pragma once

#include <Eigen/Core>

namespace tendril::fem {

/// Whether cables may push.
enum class Sign {
  kPullOnly,   ///< λ ≥ 0: a cable that would push goes slack
  kBilateral,  ///< any λ, as rods
};

/// Tensions that impose shortenings on a linearised body. Pull-only cables obey Signorini's conditions: taut
/// and at the imposed length, or slack and shorter than it allows,
///   λ ≥ 0,   w = W_aa λ + δ_a_free − δ_a ≥ 0,   λᵀw = 0,
/// solved by projected Gauss-Seidel, which converges toward the solution for every positive definite W_aa;
/// the slower, the more nearly two cables do the same.
/// @param W_aa          m × m, m/N
/// @param delta_a_free  m, m
/// @param delta_a       m imposed shortenings, m
/// @param lambda        m, N; result, and start value of the pull-only iteration
/// @return  false if no tensions were found: W_aa is singular or not finite, a cable moves nothing, or the
/// iteration
///          did not converge
/// Real-time: no (thousands of sweeps at worst).
[[nodiscard]] bool solve_tensions(const Eigen::MatrixXd& W_aa, const Eigen::VectorXd& delta_a_free,
                                  const Eigen::VectorXd& delta_a, Sign sign, Eigen::VectorXd& lambda);

}  // namespace tendril::fem
