#pragma once

#include <Eigen/Core>

#include "fem/constraints.h"
#include "fem/factor.h"

namespace tendril::fem {

/// The body as its actuators and effectors see it near one pose x_i [Largilliere 2015, eqs. 3 and 4]:
///   δ_a = W_aa λ + δ_a_free,    p_e = W_ea λ + p_e_free.
/// It is the tangent at the pose and its efforts; the free values are where that tangent puts efforts of
/// zero. δ_e_free is p_e_free less the desired position, which may change without a new Compliance.
struct Compliance {
  Eigen::MatrixXd W_ea;          ///< e × m, m/N (m³/Pa and mixtures where there are cavities)
  Eigen::MatrixXd W_aa;          ///< m × m, in the same units, symmetric positive semidefinite
  Eigen::VectorXd delta_a_free;  ///< m, m or m³
  Eigen::VectorXd p_e_free;      ///< e, m or m³
};

/// Displacements that a factored K answers with, kept to move x without a further solve.
struct Responses {
  Eigen::MatrixXd loads;      ///< 3N × (m + 1): J_aᵀ, then r = f + f_ext
  Eigen::MatrixXd moves;      ///< 3N × (m + 1): K⁻¹ J_aᵀ, then dx_free = K⁻¹ r
  Eigen::MatrixXd effectors;  ///< 3N × e: J_eᵀ
};

/// Answers of K to all actuators and to the forces out of balance.
/// @param K  factored tangent at x
/// @param r  f(x) + f_ext, 3N, N
/// Real-time: no (time depends on the mesh, allocates).
void solve_responses(const Constraints& constraints, const Eigen::VectorXd& x, Factor& K,
                     const Eigen::VectorXd& r, Responses& responses);

/// W = J K⁻¹ Jᵀ and the free values at the pose x, from the responses there.  [Largilliere 2015, eqs. 3-4]
/// Real-time: no (time depends on the mesh, allocates).
void compute_compliance(const Constraints& constraints, const Eigen::VectorXd& x, const Responses& responses,
                        Compliance& compliance);

}  // namespace tendril::fem
