#pragma once

#include <Eigen/Core>

#include "fem/body/assembler.h"
#include "fem/body/compliance.h"
#include "fem/body/constraints.h"
#include "fem/body/model.h"

namespace tendril::fem {

/// Rayleigh damping D = mass · M + stiffness · K.
struct Damping {
  double mass;       ///< 1/s
  double stiffness;  ///< s
};

/// The body in motion, its actuators at imposed displacements, its cables slack where they would push: what
/// the simulated robot is made of.
///
/// Backward Euler, linearised once a step [Baraff & Witkin, "Large Steps in Cloth Simulation", 1998]: with
/// f(x⁺) ≈ f(x) − h K v⁺,
///   ((1/h + α) M + (β + h) K) v⁺ = M v / h + f(x) + f_ext + J_aᵀ λ,    x⁺ = x + h v⁺,
/// and λ such that each actuator ends the step at its displacement, or slack. K is the tangent of body and
/// actuators, so
/// that the stiffness part of the damping acts on both. The step is stable at any h while K is semidefinite,
/// and damps motion faster than about 1/h by itself.
class Dynamics {
 public:
  /// Starts at rest, not moving. Keeps references to the model and the constraints.
  Dynamics(const Model& model, const Constraints& constraints, const Damping& damping);

  const Eigen::VectorXd& x() const { return x_; }             ///< 3N, m
  const Eigen::VectorXd& v() const { return v_; }             ///< 3N, m/s
  const Eigen::VectorXd& efforts() const { return lambda_; }  ///< m, N or Pa, during the last step
  double kinetic_energy() const;                              ///< J

  /// Places the body, with the velocity zero unless given.
  void reset(const Eigen::VectorXd& x);
  void set_velocity(const Eigen::VectorXd& v) { v_ = v; }

  /// One step, which may be as long or short as the last one or not.
  /// @param delta_a  displacements of the actuators at its end, m entries, m or m³
  /// @param h        s
  /// @return  false if the state cannot be advanced, because an element is inside out or the efforts cannot
  /// be found
  ///          (it is then unchanged)
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
