// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "qp/problem.h"

namespace tendril::rt {

/// The largest robot.
inline constexpr int kMaxActuators = qp::kMaxVariables;
inline constexpr int kMaxEffectorCoordinates = 24;

using ActuatorVector = qp::Vector;
using EffectorVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxEffectorCoordinates, 1>;
using CouplingMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxEffectorCoordinates, kMaxActuators>;

/// All that the control thread knows of the body: what the model thread made of it at one pose. Fixed
/// capacity, filled in place, never changed once published.
///
/// Near that pose [Largilliere 2015, eqs. 3-4]: δ_a = W_aa λ + δ_a_free, p_e = W_ea λ + p_e_free.
/// Units follow the kinds: an effort is in N where its displacement is in m, in Pa where it is in m³; an
/// effector coordinate is in m, or in m³ for the volume of a cavity.
struct Snapshot {
  uint64_t sequence = 0;  ///< 1 for the first
  int64_t stamp_ns = 0;   ///< when the pose was read, CLOCK_MONOTONIC
  CouplingMatrix W_ea;    ///< e × m, coordinate's unit / effort's unit
  CouplingMatrix D_W_ea;  ///< e × m: each row of W_ea times the square of its coordinate's weight
  qp::Matrix W_aa;        ///< m × m, displacement's unit / effort's unit
  CouplingMatrix G_ea;    ///< e × m, ∂p_e/∂δ_a of drives that follow displacements, see ModelRefresher
  ActuatorVector delta_a_free;  ///< m, m or m³
  EffectorVector p_e_free;      ///< e, m or m³
  ActuatorVector lambda;        ///< efforts at the pose, m, N or Pa: the start of the first solve
  qp::Problem problem;          ///< H = W_eaᵀ D W_ea (+ energy), and W_aa, prepared
};

/// What the control thread tells the model thread.
struct Feedback {
  int64_t stamp_ns = 0;
  bool displacements_known = false;  ///< delta_a holds what the drives measured
  bool efforts_known = false;        ///< lambda holds what the drives exert, or what stands for their command
  ActuatorVector delta_a;            ///< measured displacements, m, m or m³
  ActuatorVector lambda;             ///< efforts, m, N or Pa
};

}  // namespace tendril::rt
