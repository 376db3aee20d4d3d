// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "rt/snapshot.h"

namespace tendril::app {

/// How fast a target may move: |v| ≤ speed, |a| ≤ acceleration, |j| ≤ jerk, all above 0 and of the position
/// in space, m/s, m/s², m/s³.
struct MotionLimits {
  double speed, acceleration, jerk;
};

/// The least time to change the velocity by `step`, m/s, from and to acceleration 0.  s
double ramp_time(double step, const MotionLimits& limits);

/// Where a target is over time: pieces of constant jerk, one after another, without a jump in position,
/// velocity or acceleration. Each change of velocity is a ramp: the acceleration rises, stays and falls,
/// always along the change. A corner is a ramp from one direction to the next, so it is a curve; the velocity
/// on it lies between those at its ends, so that its bounds hold in every direction.
/// Real-time: no, for all of it (allocates).
class MotionProfile {
 public:
  struct State {
    rt::EffectorVector position, velocity, acceleration;  ///< e, m or m³, per s and per s²
    double left_s = 0;                                    ///< until the jerk changes
    bool jerk_free = true;                                ///< until then the acceleration is constant
    std::size_t label = 0;                                ///< of the piece
  };

  /// At rest at a position, e, m or m³.
  explicit MotionProfile(rt::EffectorVector start);

  /// In motion: the acceleration goes to 0, then the velocity to another one, within the limits of
  /// acceleration and jerk.
  /// @param velocity   at the end, e
  /// @param positions  1 for coordinates that are positions in space, 0 for others, e
  MotionProfile(const State& motion, const rt::EffectorVector& velocity, const rt::EffectorVector& positions,
                const MotionLimits& limits);

  /// Changes the velocity.
  /// @param velocity  at the end, e, m/s or m³/s
  /// @param step      size of the change in space, m/s
  void ramp(const rt::EffectorVector& velocity, double step, const MotionLimits& limits);
  void cruise(double seconds);

  /// Goes on straight: from speed v0, which the profile has, over the fastest that limits and length allow,
  /// to v1.
  /// @param direction  per metre of space, e
  /// @param length     m; at least what the change from v0 to v1 takes, see ramp_distance()
  void straight(const rt::EffectorVector& direction, double length, double v0, double v1,
                const MotionLimits& limits);

  /// Goes on straight from rest to rest in the least time that the limits allow: seven pieces or fewer.
  /// @param distance  in space, m; 0: it is there at once
  void go_to(const rt::EffectorVector& goal, double distance, const MotionLimits& limits);

  /// Puts the end of the profile where it was meant to be, against rounding.
  void end_at(const rt::EffectorVector& position) { here_.position = position; }
  const rt::EffectorVector& end() const { return here_.position; }
  void set_label(std::size_t label) { label_ = label; }

  double duration_s() const { return end_s_; }

  /// @param t_s  from the beginning; before and after the profile its ends hold
  State at(double t_s) const;

 private:
  struct Piece {
    double begin_s;
    rt::EffectorVector position, velocity, acceleration, jerk;
    std::size_t label;
  };

  void add(double seconds, const rt::EffectorVector& acceleration, const rt::EffectorVector& jerk);

  std::vector<Piece> pieces_;
  State here_;  // at the end of the last piece
  double end_s_ = 0;
  std::size_t label_ = 0;
};

/// The distance that a change from speed v0 to v1 takes, m.
double ramp_distance(double v0, double v1, const MotionLimits& limits);

/// From rest to rest, see MotionProfile::go_to().
MotionProfile rest_to_rest(const rt::EffectorVector& from, const rt::EffectorVector& to, double distance,
                           const MotionLimits& limits);

/// Straight at constant speed, without limits.
MotionProfile at_constant_speed(const rt::EffectorVector& from, const rt::EffectorVector& to, double distance,
                                double speed);

}  // namespace tendril::app
