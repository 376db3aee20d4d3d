// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "app/config/config.h"

// Places in a robot file, for messages. Real-time: no, all of it.
namespace tendril::app {

/// Where a robot file says what an actuator or effector is attached to.
struct Place {
  const char* key;  ///< "cable", "point"…
  int line;         ///< of its first point, or of its region
};
Place place_of(const ActuatorConfig& actuator);
Place place_of(const EffectorConfig& effector);

/// The points that an actuator is attached to, from its end on; none where it is a cavity.
std::vector<PointConfig> points_of(const ActuatorConfig& actuator);

/// A key of an actuator or effector for messages: "actuators[0].cable (left)".
std::string actuator_key(const Config& config, int index, const char* key);
std::string effector_key(const Config& config, int index, const char* key);

}  // namespace tendril::app
