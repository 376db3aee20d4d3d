// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <any>
#include <limits>
#include <optional>

#include "hal/sim/simulated_servo.h"

namespace tendril::hal {

/// The actuator that a simulated drive moves, and the settings of the drive. Displacements in m or m³,
/// efforts in N or Pa.
struct SimulatedActuator {
  static constexpr double kUnlimited = std::numeric_limits<double>::infinity();
  double top_rate = 0;                                         // per second, > 0, of its displacement
  double displacement = 0;                                     // at power-on
  double displacement_range = 0;                               // from the least to the greatest
  double force_limit = kUnlimited;                             // N or Pa, > 0: greatest effort of the motor
  double acceleration_time = ServoTuning{}.acceleration_time;  // s, see ServoTuning
  double friction = ServoTuning{}.friction;                    // see ServoTuning
  bool left_enabled = false;              // at power-on its drive is enabled, as another controller left it
  std::optional<double> position_gain{};  // 1/s; none: as drives of the protocol are delivered
  std::any protocol_settings{};           // settings of the protocol, see DriveProtocol::read_simulation
};

/// The tuning of an actuator's servo.
/// @param usual  the default of the protocol
inline ServoTuning tuned(ServoTuning usual, const SimulatedActuator& actuator) {
  return {.acceleration_time = actuator.acceleration_time,
          .position_gain = actuator.position_gain.value_or(usual.position_gain),
          .friction = actuator.friction};
}

}  // namespace tendril::hal
