// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/config/config.h"
#include "tests/app/robot_file.h"

namespace tendril::app {

/// A silicone block of 30 x 30 x 60 mm on its foot at z = 0 with a closed cavity of 10 x 10 x 40 mm in its
/// middle, and one actuator of each kind: a cavity, a cable, a rod, a force. Its top and the volume of the
/// cavity are effectors. File and mesh go with the object.
struct Block {
  /// @param changes  each replaces the first such piece of the file
  explicit Block(const Changes& changes = {});

  RobotFile file;
  Config config;
};

/// What a block's file says, at another control rate; the file itself is gone.
Config block_at(double rate_hz);

/// The place of each of its actuators.
enum BlockActuator { kAir, kString, kStrut, kThumb };

}  // namespace tendril::app
