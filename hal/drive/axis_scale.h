// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace tendril::hal {

/// Converts between the displacement of an actuator and the position of its drive, and between its effort
/// and the torque of the drive. Displacements are in m (cable wound up, travel of a rod) or m³ (fluid
/// pumped), efforts in N or Pa, for all protocols alike.
struct AxisScale {
  double counts_per_turn = 0;  // encoder counts in one turn of the drive, > 0; 1 where positions are in turns
  double displacement_per_turn = 0;  // m or m³, > 0: circumference of a pulley, lead, volume of a pump
  bool reversed = false;             // true where the displacement falls as the count rises
  double offset = 0;                 // displacement at position 0 of the drive, m or m³

  /// Displacement of one count, m or m³, negative where reversed. Real-time: yes.
  double displacement_per_count() const noexcept {
    const double magnitude = displacement_per_turn / counts_per_turn;
    return reversed ? -magnitude : magnitude;
  }

  /// Position for a displacement, counts with their fraction. Real-time: yes.
  double to_position(double displacement) const noexcept {
    return (displacement - offset) / displacement_per_count();
  }

  /// The same in whole counts, clamped to the 32-bit range.
  /// @param displacement  finite, m or m³
  /// Real-time: yes.
  int32_t to_counts(double displacement) const noexcept {
    return static_cast<int32_t>(
        std::clamp(std::round(to_position(displacement)), double{INT32_MIN}, double{INT32_MAX}));
  }

  /// Displacement at a position, m or m³. @param counts  with their fraction. Real-time: yes.
  double to_displacement(double counts) const noexcept { return offset + counts * displacement_per_count(); }

  /// Torque of an effort at the shaft that is counted, Nm, positive towards higher counts. The power is the
  /// same: effort · d(displacement) = torque · d(angle), without losses. Real-time: yes.
  double to_torque(double effort) const noexcept {
    const double magnitude = effort * displacement_per_turn / (2 * std::numbers::pi);
    return reversed ? -magnitude : magnitude;
  }
};

}  // namespace tendril::hal
