// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/qp/random_problem.h"

namespace tendril::qp {

/// A problem of random_qp() made worse, each at random: actuators that are nearly another's copy, targets
/// distance out of reach, pressures in Pa next to forces in N, strokes given exactly, bounds without room,
/// and numbers that are none.
/// @param seed  the same gives the same problem; n and all else come from it
struct AdversarialProblem {
  explicit AdversarialProblem(uint64_t seed);

  Qp qp;
  bool feasible = false;  // some point meets bounds and rows; where not, there may still be one
  bool extreme =
      false;  // the minimum of the objective alone is more than 1000 times as distance as the bounds
  bool well_posed = true;  // else a number is none, or a lower bound is above its upper one
};

}  // namespace tendril::qp
