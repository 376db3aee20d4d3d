// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/config/config.h"
#include "app/jog/jog.h"

namespace tendril::app {

/// What `tendrilctl jog` was told; quantities as a person types them, empty for the default.
struct JogOptions {
  std::string file, actuator;
  std::string by, speed, limit, lag;
  std::string bus;  ///< empty: the robot file's
  bool json = false;
  bool allow_non_rt = false;
};

/// What they say of the motion of an actuator.
/// @param period_s  of the control loop
/// @throws ConfigError that names the option, what was found and what is expected
/// Real-time: no (allocates).
JogConfig jog_config(const JogOptions& options, const ActuatorConfig& actuator, double period_s);

}  // namespace tendril::app
