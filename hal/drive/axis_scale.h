#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace tendril::hal {

/// How the displacement of an axis' actuator becomes a position of its drive, and its effort a torque.
/// Displacements are in m (cable wound up, travel of a rod) or m³ (fluid pumped), efforts in N or Pa; the
/// protocol does not care which.
struct AxisScale {
  double counts_per_turn = 0;  // encoder counts in one turn of the drive, > 0; 1 where positions are in turns
  double displacement_per_turn =
      0;                  // in the same turn, > 0: a pulley's circumference, a lead, a pump's volume
  bool reversed = false;  // true where the displacement falls as the count rises
  double offset = 0;      // displacement where the drive reads 0, m or m³

  /// Displacement of one count, negative where reversed. Real-time: yes.
  double displacement_per_count() const noexcept {
    const double magnitude = displacement_per_turn / counts_per_turn;
    return reversed ? -magnitude : magnitude;
  }

  /// Position for a displacement, counts with their fraction. Real-time: yes.
  double to_position(double displacement) const noexcept {
    return (displacement - offset) / displacement_per_count();
  }

  /// The same in whole counts, at the ends of the 32-bit range at most.
  /// @param displacement  finite
  /// Real-time: yes.
  int32_t to_counts(double displacement) const noexcept {
    return static_cast<int32_t>(
        std::clamp(std::round(to_position(displacement)), double{INT32_MIN}, double{INT32_MAX}));
  }

  /// Displacement at that count, which may have a fraction. Real-time: yes.
  double to_displacement(double counts) const noexcept { return offset + counts * displacement_per_count(); }

  /// Torque in the same place that stands for an effort, Nm, positive towards higher counts: the power is the
  /// same, effort · d(displacement) = torque · d(angle), whatever the efficiency. Real-time: yes.
  double to_torque(double effort) const noexcept {
    const double magnitude = effort * displacement_per_turn / (2 * std::numbers::pi);
    return reversed ? -magnitude : magnitude;
  }
};

}  // namespace tendril::hal
