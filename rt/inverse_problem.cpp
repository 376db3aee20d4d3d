// SPDX-License-Identifier: Apache-2.0
#include "rt/inverse_problem.h"

namespace tendril::rt {

InverseProblem::InverseProblem(const ActuatorVector& a_min, const ActuatorVector& a_max, int iteration_cap)
    : bounds_{a_min, a_max, {}, {}}, iteration_cap_(iteration_cap) {}

const qp::Solution& InverseProblem::solve(const Snapshot& snapshot, const EffectorVector& desired,
                                          const ActuatorVector& l_min, const ActuatorVector& l_max,
                                          const ActuatorVector& hold) noexcept {
  bounds_.row_lower = l_min - snapshot.delta_a_free;
  bounds_.row_upper = l_max - snapshot.delta_a_free;
  g_.noalias() = snapshot.D_W_ea.transpose() * (snapshot.p_e_free - desired);
  return solver_.solve(snapshot.problem, g_, bounds_, hold, iteration_cap_);
}

}  // namespace tendril::rt
