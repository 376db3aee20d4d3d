#pragma once

#include <cstdint>

#include "app/robot.h"
#include "fem/equilibrium.h"
#include "rt/snapshot.h"

namespace tendril::app {

/// What the model thread does between reading feedback and publishing a snapshot.
class ModelRefresher {
 public:
  /// Keeps a reference to the robot.
  /// @param epsilon  weight of the energy term of the QP, unitless
  ModelRefresher(const Robot& robot, double epsilon);

  /// Brings the body to rest at measured cable lengths, so that the first snapshot fits what the drives hold.
  /// @param delta_a  m shortenings, m
  /// @return  false if it found no equilibrium there
  /// Real-time: no (many refreshes).
  [[nodiscard]] bool settle(const Eigen::VectorXd& delta_a);

  /// Moves the body by one Newton step under the efforts λ (m, N; those of settle() where the controller has
  /// none yet), linearises it there and fills the snapshot. [Largilliere 2015, section III, steps 2, 3 and 7]
  /// @return  false if the pose cannot be used; the body is then back at the last good one and the snapshot
  /// is void Real-time: no (time depends on the mesh).
  [[nodiscard]] bool refresh(const rt::Feedback& feedback, std::int64_t now_ns, rt::Snapshot& snapshot);

  const Eigen::VectorXd& x() const { return equilibrium_.x(); }

 private:
  bool near_settled(const Eigen::VectorXd& delta_a) const;
  bool fill(const fem::Compliance& compliance, const Eigen::VectorXd& lambda, std::int64_t now_ns,
            rt::Snapshot& snapshot);

  double epsilon_;
  fem::Equilibrium equilibrium_;
  Eigen::VectorXd lambda_;  // efforts at the last good pose
  Eigen::VectorXd last_good_x_;
  Eigen::VectorXd settled_at_;  // lengths of the last settle, m
  std::uint64_t sequence_ = 0;
};

}  // namespace tendril::app
