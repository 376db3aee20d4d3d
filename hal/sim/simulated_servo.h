#pragma once

#include <cstdint>

namespace tendril::hal {

/// How quick a servo axis is.
struct ServoTuning {
  double acceleration_time = 5e-3;  // s from rest to top speed at the force limit without load, at least 1 ms
  double position_gain = 100;       // 1/s, above 0, at most 1000: speed demanded for a unit of error
  double friction = 0.05;           // of the force limit, above 0: what resists at top speed where it pushes
};

/// Motion of a simulated servo axis: a position loop around a velocity loop around a motor of limited force.
///
///   u = w + k_p (r − q), within ± top speed;    dv/dt = 4 k_p (u − v), within what the motor's force allows;
///   dq/dt = v
///
/// with the position q in the drive's own unit (counts or turns), its set-point r, and a rate w fed forward.
/// Both poles are at −2 k_p, so that while no limit is met a step of r is followed without overshoot, and a
/// ramp of r at a distance of (its rate − w) / k_p.
///
/// The load is measured against the force limit F, and the inertia is what F brings to top speed in the
/// acceleration time. A load of up to F costs acceleration only: the loops compensate it, as integral action
/// does. Beyond, the axis gives way; motor and gear resist being driven backwards with a force that grows
/// from F at rest to 2F at top speed, so that it does so at top speed · (load / F − 1), and never faster than
/// top speed. Without power, and where it is jammed, it stands: its gear is self-locking.
///
/// Instead of following a set-point it may push with a force f, less what resists, which grows with its speed
/// to the friction s F at top speed:
///
///   inertia · dv/dt = f − load − s F · v / top speed,    within ± top speed,
///
/// so that it stands where the load equals f. Friction that holds a standing axis is left out.
///
/// The loops run on ticks of their own at fixed instants, so that it does not matter how time is cut into
/// calls.
class SimulatedServo {
 public:
  static constexpr std::int64_t kTick_ns = 125'000;

  /// Stands without power.
  /// @param top_speed  units/s, > 0
  /// @param position   units
  /// Real-time: yes.
  SimulatedServo(double top_speed, const ServoTuning& tuning, double position) noexcept;

  /// Lets time pass.
  /// @param now_ns  not negative, never before an earlier call's; of more than 5 s at once the first are
  ///                passed over
  /// Real-time: yes (bounded, no allocation).
  void advance(std::int64_t now_ns) noexcept;

  /// Takes away the power: it stops dead, and the set-point is where it stands. Real-time: yes.
  void lock() noexcept;

  /// Gives it power: it follows its set-point. Real-time: yes.
  void unlock() noexcept { locked_ = false; }

  /// Lets the set-point go to `goal` at an even rate, which is fed forward, and stand there.
  /// @param duration_ns  from the last call of `advance` on, > 0
  /// Real-time: yes.
  void interpolate(double goal, std::int64_t duration_ns) noexcept;

  /// Puts the set-point to `goal` at once.
  /// @param rate  fed forward until the next set-point, units/s
  /// Real-time: yes.
  void pass_through(double goal, double rate) noexcept;

  /// Pushes with a force, until there is another set-point.
  /// @param force  in force limits, within ± 1; positive pushes towards higher positions
  /// Real-time: yes.
  void push(double force) noexcept;

  /// Keeps the speed that the loops demand below top speed.
  /// @param speed  units/s; 0 where it is negative
  /// Real-time: yes.
  void limit_speed(double speed) noexcept;

  /// Pulls at it from now on.
  /// @param load  in force limits; positive pulls towards lower positions
  /// Real-time: yes.
  void set_load(double load) noexcept { load_ = load; }

  /// Jams its mechanics, or lets them go; its set-point goes on. Real-time: yes.
  void set_jammed(bool jammed) noexcept { jammed_ = jammed; }

  double position() const noexcept { return position_; }  ///< Units. Real-time: yes.
  double velocity() const noexcept { return velocity_; }  ///< Units/s. Real-time: yes.

  double set_point() const noexcept { return set_point(now_ns_); }  ///< Units. Real-time: yes.

  /// Set-point less position, units; 0 without power and where it pushes. Real-time: yes.
  double following_error() const noexcept { return set_point() - position_; }

  /// What the motor exerts, in force limits: against load, inertia and, where it pushes, friction; 0 without
  /// power. Real-time: yes.
  double force() const noexcept;

 private:
  void tick(std::int64_t now_ns) noexcept;
  double acceleration_towards(double speed) const noexcept;
  double acceleration_under(double force) const noexcept;
  double friction() const noexcept;
  double set_point(std::int64_t now_ns) const noexcept;

  double top_speed_, speed_limit_;  // units/s
  ServoTuning tuning_;
  std::int64_t now_ns_ = 0, ticks_ = -1;  // -1: not begun
  bool locked_ = true, jammed_ = false, pushes_ = false;
  double load_ = 0, force_ = 0;  // in force limits
  double position_, velocity_ = 0;
  double acceleration_ = 0;  // that the last tick demanded, units/s²

  double set_point_;             // at the last tick
  double goal_, slope_ = 0;      // where the set-point goes, and how fast, units/s
  std::int64_t arrival_ns_ = 0;  // of the set-point at its goal
  double fed_forward_ = 0;       // beside the slope, units/s
};

}  // namespace tendril::hal
