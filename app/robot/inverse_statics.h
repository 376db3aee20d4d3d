// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "app/robot/robot.h"
#include "rt/snapshot.h"

namespace tendril::app {

/// A static answer of the inverse problem.
struct StaticSolution {
  enum class Obstacle : uint8_t { kNoEquilibrium, kQpCapped, kQpIllPosed, kNoRest };

  bool converged = false;  ///< efforts and body have come to rest; otherwise the vectors may be empty
  Obstacle obstacle = Obstacle::kNoEquilibrium;  ///< what kept it from that
  int refreshes = 0;
  Eigen::VectorXd lambda;   ///< efforts, m, N or Pa
  Eigen::VectorXd delta_a;  ///< displacements, m, m or m³
  Eigen::VectorXd p_e;      ///< where the effectors come to stand, e, m or m³
};

/// Brings the effectors as near to a goal as limits allow, without time: solve the QP, refresh the model,
/// repeat. What `--check` tells of the waypoints, and what static references are compared with.
/// @param robot  built from the configuration; top rates do not count
/// @param goal   e, m or m³
/// Real-time: no.
StaticSolution solve_inverse_statics(const Robot& robot, const Config& config,
                                     const rt::EffectorVector& goal);

/// Where the effectors are when the body rests with all actuators at displacement zero, e, m or m³; where it
/// finds no rest there, as its loads bend it too far, where they are in the shape of the mesh.
/// Real-time: no.
rt::EffectorVector effectors_at_rest(const Robot& robot);

}  // namespace tendril::app
