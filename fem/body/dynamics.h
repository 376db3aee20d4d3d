// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "fem/body/assembler.h"
#include "fem/body/compliance.h"
#include "fem/body/constraints.h"
#include "fem/body/model.h"

namespace tendril::fem {

/// Rayleigh damping α M + β K.
struct Damping {
  double mass;       ///< α, 1/s
  double stiffness;  ///< β, s
};

/// The body in motion, with its actuators at imposed displacements; cables that would push are slack. The
/// simulated robot is made of it.
///
/// Backward Euler, linearised once a step [Baraff & Witkin, "Large Steps in Cloth Simulation", 1998]. With
/// the damping α M + β K and f(x⁺) ≈ f(x) − h K v⁺,
///   ((1/h + α) M + (β + h) K) v⁺ = M v / h + f(x) + f_ext + J_aᵀ λ,    x⁺ = x + h v⁺.
/// λ is such that each actuator ends the step at its displacement, or slack. K is the tangent of body and
/// actuators, so that β damps both. The step is stable for any h while K is semidefinite. It damps motion
/// faster than about 1/h by itself.
class Dynamics {
 public:
  /// Starts at the shape of the mesh with velocity 0. Keeps references to the model and the constraints.
  /// Real-time: no (allocates).
  Dynamics(const Model& model, const Constraints& constraints, const Damping& damping);

  const Eigen::VectorXd& x() const { return x_; }             ///< 3N, m
  const Eigen::VectorXd& v() const { return v_; }             ///< 3N, m/s
  const Eigen::VectorXd& efforts() const { return lambda_; }  ///< m, N or Pa, during the last step
  double kinetic_energy() const;                              ///< J

  /// Sets the pose (3N, m), and the velocity and efforts to 0.
  void reset(const Eigen::VectorXd& x);
  /// Sets the velocity, 3N, m/s.
  void set_velocity(const Eigen::VectorXd& v) { v_ = v; }

  /// One step of length h (s), which may differ from step to step.
  /// @param delta_a  displacements of the actuators at its end, m, m or m³
  /// @return         false if an element is inverted or no efforts are found; the state is then unchanged
  /// Real-time: no (time depends on the mesh).
  [[nodiscard]] bool step(const Eigen::VectorXd& delta_a, double h);

 private:
  bool compute_response(double h);

  const Model& model_;
  const Constraints& constraints_;
  Damping damping_;
  StiffnessMatrix A_;
  Assembler assembler_;
  Response response_;
  Eigen::VectorXd x_, v_, lambda_, next_lambda_, r_, delta_a_free_;
  Eigen::MatrixXd W_;
};

}  // namespace tendril::fem
