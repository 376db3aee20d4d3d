// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendril::hal {

/// The dynamics of a servo axis.
struct ServoTuning {
  double acceleration_time = 5e-3;  // s from rest to top speed at the force limit without load, at least 1 ms
  double position_gain = 100;       // 1/s, above 0, at most 1000: demanded speed per unit of error
  double friction = 0.05;           // at top speed, share of the force limit, above 0; in force control
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
/// Loads are in units of the force limit F. F accelerates the inertia from rest to top speed in the
/// acceleration time. A load of up to F only reduces acceleration: the loops compensate it, as integral
/// action does. A greater load drives the axis backwards. Motor and gear resist that with a force that grows
/// from F at rest to 2F at top speed, so the axis moves at top speed · (load / F − 1), and never faster than
/// top speed. Without power, and when jammed, the axis stands: its gear is self-locking.
///
/// In force control it follows no set-point but exerts a force f. A friction resists that grows with its
/// speed to s F at top speed:
///
///   inertia · dv/dt = f − load − s F · v / top speed,    within ± top speed,
///
/// so that it stands when the load equals f. There is no static friction.
///
/// The loops run at fixed instants, kTick_ns apart, so the motion does not depend on how often `advance` is
/// called.
class SimulatedServo {
 public:
  static constexpr int64_t kTick_ns = 125'000;

  /// An axis at rest, without power.
  /// @param top_speed  units/s, > 0
  /// @param position   units
  /// Real-time: yes.
  SimulatedServo(double top_speed, const ServoTuning& tuning, double position) noexcept;

  /// Lets time pass.
  /// @param now_ns  not negative, never before an earlier call's; of a step of more than 5 s only the last 5
  ///                s are computed
  /// Real-time: yes (bounded, no allocation).
  void advance(int64_t now_ns) noexcept;

  /// Takes away the power: the axis stops at once, and its position becomes the set-point. Real-time: yes.
  void lock() noexcept;

  /// Gives the axis power: it follows its set-point. Real-time: yes.
  void unlock() noexcept { locked_ = false; }

  /// Moves the set-point to `goal` at a constant rate, which is fed forward; there it stays.
  /// @param goal         units
  /// @param duration_ns  from the last call of `advance` on, > 0
  /// Real-time: yes.
  void interpolate(double goal, int64_t duration_ns) noexcept;

  /// Sets the set-point to `goal` at once.
  /// @param goal  units
  /// @param rate  fed forward until the next set-point, units/s
  /// Real-time: yes.
  void pass_through(double goal, double rate) noexcept;

  /// Exerts a force until the next set-point.
  /// @param force  share of the force limit, within ± 1; positive towards higher positions
  /// Real-time: yes.
  void apply_force(double force) noexcept;

  /// Limits the speed that the loops demand.
  /// @param speed  units/s; 0 where it is negative
  /// Real-time: yes.
  void limit_speed(double speed) noexcept;

  /// Sets the external load.
  /// @param load  share of the force limit; positive pulls towards lower positions
  /// Real-time: yes.
  void set_load(double load) noexcept { load_ = load; }

  /// Jams its mechanics, or releases them; the set-point still moves. Real-time: yes.
  void set_jammed(bool jammed) noexcept { jammed_ = jammed; }

  double position() const noexcept { return position_; }  ///< Units. Real-time: yes.
  double velocity() const noexcept { return velocity_; }  ///< Units/s. Real-time: yes.

  double set_point() const noexcept { return set_point(now_ns_); }  ///< Units. Real-time: yes.

  /// Set-point less position, units; 0 without power and in force control. Real-time: yes.
  double following_error() const noexcept { return set_point() - position_; }

  /// Force of the motor, share of the force limit: against load, inertia and, in force control, friction; 0
  /// without power. Real-time: yes.
  double force() const noexcept;

 private:
  void tick(int64_t now_ns) noexcept;
  double acceleration_towards(double speed) const noexcept;
  double acceleration_under(double force) const noexcept;
  double friction() const noexcept;
  double set_point(int64_t now_ns) const noexcept;

  double top_speed_, speed_limit_;  // units/s
  ServoTuning tuning_;
  int64_t now_ns_ = 0, ticks_ = -1;  // -1: not begun
  bool locked_ = true, jammed_ = false, force_controlled_ = false;
  double load_ = 0, force_ = 0;     // shares of the force limit
  double position_, velocity_ = 0;  // units, units/s
  double acceleration_ = 0;         // demanded at the last tick, units/s²

  double set_point_;         // at the last tick
  double goal_, slope_ = 0;  // where the set-point goes, and how fast, units and units/s
  int64_t arrival_ns_ = 0;   // of the set-point at its goal
  double fed_forward_ = 0;   // besides the slope, units/s
};

}  // namespace tendril::hal
