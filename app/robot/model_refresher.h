// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "app/robot/robot.h"
#include "fem/body/equilibrium.h"
#include "rt/snapshot.h"

namespace tendril::app {

/// ‖H‖∞/‖W_aa‖∞, the weighed squared error that a joule is worth, which scales the energy term of the QP as
/// in SOFA, where control.epsilon asks for one. The norm of a row adds up its entries, so that newtons and
/// pascals must be made comparable first: the efforts of each unit are counted in the amount that puts ½ J
/// into the softest actuator of that unit. Where there is one unit alone this cancels.
/// @param H         W_eaᵀ D W_ea, m × m
/// @param pressure  which efforts are in Pa, the others are in N; m
double error_per_joule(const qp::Matrix& H, const qp::Matrix& W_aa, const Eigen::ArrayX<bool>& pressure);

/// ∂p_e/∂δ_a of the drives that prescribe displacements, the efforts of all others being held:
/// W_ep W_pp⁻¹ in their columns p, 0 in the others. Combinations of them that hardly move anything, as of
/// cables side by side, are left out.
/// @param prescribed  which actuators' displacements are, and hold against the body, m
/// @return            e × m
/// Real-time: no (allocates).
rt::CouplingMatrix effectors_per_displacement(const rt::CouplingMatrix& W_ea, const qp::Matrix& W_aa,
                                              const Eigen::ArrayX<bool>& prescribed);

/// What the model thread does between reading feedback and publishing a snapshot.
class ModelRefresher {
 public:
  /// Keeps a reference to the robot.
  /// @param config  the one that it was built from
  ModelRefresher(const Robot& robot, const Config& config);

  /// Brings the body to rest at measured displacements, so that the first snapshot fits what the drives hold.
  /// @param delta_a  m displacements, m or m³
  /// @return  false if it found no equilibrium there
  /// Real-time: no (many refreshes).
  [[nodiscard]] bool settle(const Eigen::VectorXd& delta_a);

  /// Moves the body by one Newton step under the efforts λ (m, N or Pa; where the controller has none, those
  /// of rest at the measured displacements), linearises it there and fills the snapshot. [Largilliere 2015,
  /// section III, steps 2, 3 and 7]
  /// @return  false if the pose cannot be used; the body is then back at the last good one and the snapshot
  /// is void Real-time: no (time depends on the mesh).
  [[nodiscard]] bool refresh(const rt::Feedback& feedback, int64_t now_ns, rt::Snapshot& snapshot);

  const Eigen::VectorXd& x() const { return equilibrium_.x(); }

 private:
  bool rests_at(const Eigen::VectorXd& delta_a) const;
  bool fill(const fem::Compliance& compliance, const Eigen::VectorXd& lambda, int64_t now_ns,
            rt::Snapshot& snapshot);

  double epsilon_;
  fem::Tangent tangent_;
  Eigen::VectorXd weights_;                   // of the effector coordinates
  Eigen::VectorXd moved_;                     // smallest changes that count, m or m³
  Eigen::ArrayX<bool> pressure_;              // efforts in Pa, the others are in N
  bool feedback_;                             // effectors are measured, for which snapshots need G_ea
  Eigen::ArrayX<bool> follows_displacement_;  // of the drives
  Eigen::ArrayXd slack_;  // an effort that is as low is none, N or Pa; -∞ where it may push
  fem::Equilibrium equilibrium_;
  Eigen::VectorXd lambda_;  // efforts at the last good pose
  Eigen::VectorXd asked_;   // efforts of the present refresh
  Eigen::VectorXd last_good_x_;
  Eigen::VectorXd settled_at_;     // displacements of the last settle, m or m³
  bool moved_by_efforts_ = false;  // since then
  uint64_t sequence_ = 0;
};

/// Fills a snapshot with the body at rest at displacement zero, for measurements of what follows from one; a
/// body without such a rest stays in the shape of the mesh, which serves as well.
/// @throws ConfigError where it cannot be linearised there
/// Real-time: no (many refreshes).
void linearise_at_rest(const Robot& robot, const Config& config, int64_t now_ns, rt::Snapshot& snapshot);

}  // namespace tendril::app
