#pragma once

#include <Eigen/Core>

#include "app/robot.h"
#include "rt/snapshot.h"

namespace tendril::app {

/// A static answer of the inverse problem.
struct StaticReach {
  bool converged = false;  ///< efforts and body have come to rest; otherwise the vectors may be empty
  int refreshes = 0;
  Eigen::VectorXd lambda;   ///< efforts, m, N
  Eigen::VectorXd delta_a;  ///< shortenings, m, m
  Eigen::VectorXd p_e;      ///< where the effectors come to stand, e, m
};

/// Brings the effectors as near to a goal as limits allow, without time: solve the QP, refresh the model,
/// repeat. What `--check` tells of the waypoints, and what static references are compared with.
/// @param limits  efforts and strokes; top speeds do not count
/// @param goal    e, m
/// Real-time: no.
StaticReach reach(const Robot& robot, const rt::ControllerConfig& limits, double epsilon,
                  const rt::EffectorVector& goal);

}  // namespace tendril::app
