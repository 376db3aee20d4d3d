// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>

#include "qp/solver.h"

namespace tendril::qp {

/// What the actuators that are added to a robot pull like.
enum class Added {
  kNone,
  kDuplicate,  ///< exactly like an actuator of the robot
  kNear,       ///< like one, with the guide moved a little: see RedundantRobot::distance
  kOpposite,   ///< against one
  kOther,      ///< like none
};

/// A robot under control, its compliance drifting with its pose: W = J Jᵀ with the rows J_a, J_e of a random
/// body. Its first actuators are the same whatever is added. Efforts are 0 to 8; displacements have limits
/// and a top rate.
struct RedundantRobot {
  int actuators = 4, coordinates = 3;  // of the robot itself
  Added added = Added::kNone;
  int more = 1;            // added actuators
  double distance = 1e-2;  // of kNear, relative to the length of the row of J_a
  double epsilon = 0;      // of the energy term in H
  uint64_t seed = 1;

  struct Cycle {
    bool new_snapshot = false;
    Matrix H, A;
    Vector g;
    Bounds bounds;
    Eigen::MatrixXd W_ea;
    Eigen::VectorXd delta_e;  // at zero efforts

    double residual(const Vector& x) const { return (W_ea * x + delta_e).norm(); }
  };

  int n() const { return actuators + (added == Added::kNone ? 0 : more); }
  /// The problem of cycle i, without the top rates.
  /// @param reach  size of the path, relative to what one actuator at full effort moves the effector by
  Cycle cycle(int i, double reach) const;
};

/// Narrows the rows' bounds to what the top rate allows from these displacements.
void limit_rate(const Vector& displacement, double step, Bounds& bounds);

}  // namespace tendril::qp
