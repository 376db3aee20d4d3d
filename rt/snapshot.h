#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "qp/problem.h"

namespace tendril::rt {

/// The largest robot: 32 actuators, 24 effector coordinates.
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
struct Snapshot {
  std::uint64_t sequence = 0;   ///< 1 for the first
  std::int64_t stamp_ns = 0;    ///< when the pose was read, CLOCK_MONOTONIC
  CouplingMatrix W_ea;          ///< e × m, m/N
  qp::Matrix W_aa;              ///< m × m, m/N
  ActuatorVector delta_a_free;  ///< m, m
  EffectorVector p_e_free;      ///< e, m
  ActuatorVector lambda;        ///< efforts at the pose, m, N: the start of the first solve
  qp::Problem problem;          ///< H and W_aa, prepared
};

/// What the control thread tells the model thread.
struct Feedback {
  std::int64_t stamp_ns = 0;
  bool lengths_known = false;  ///< delta_a holds what the drives measured
  bool efforts_known = false;  ///< lambda holds what the controller last asked for
  ActuatorVector delta_a;      ///< measured shortenings, m, m
  ActuatorVector lambda;       ///< efforts, m, N
};

}  // namespace tendril::rt
