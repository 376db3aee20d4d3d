// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "qp/solver.h"
#include "rt/snapshot.h"

namespace tendril::rt {

/// The inverse problem of one robot: which efforts bring its effectors nearest to where they are wanted.
/// Poses the QP on a snapshot and solves it; each solve starts from the working set of the one before.
class InverseProblem {
 public:
  /// @param a_min, a_max   limits of the efforts, m, N or Pa
  /// @param iteration_cap  of each solve
  InverseProblem(const ActuatorVector& a_min, const ActuatorVector& a_max, int iteration_cap);

  /// min ½ λᵀHλ + gᵀλ   s.t.   a_min ≤ λ ≤ a_max,   l_min ≤ W_aa λ + δ_a_free ≤ l_max,
  /// with g = W_eaᵀ D (p_e_free − desired).  [Largilliere 2015, eqs. 5-6]
  /// @param desired       e, m or m³
  /// @param l_min, l_max  limits of the displacements, m, m or m³
  /// @param hold          m, N or Pa: the fallback, see qp::Solver::solve
  /// @return  valid until the next call
  /// Real-time: as qp::Solver::solve.
  const qp::Solution& solve(const Snapshot& snapshot, const EffectorVector& desired,
                            const ActuatorVector& l_min, const ActuatorVector& l_max,
                            const ActuatorVector& hold) noexcept;

  /// Makes the next solve start from an empty working set. Real-time: wait-free.
  void forget_working_set() noexcept { solver_.reset(); }

 private:
  qp::Solver solver_;
  qp::Bounds bounds_;
  ActuatorVector g_;
  int iteration_cap_;
};

}  // namespace tendril::rt
