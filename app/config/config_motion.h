// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "app/config/config.h"
#include "app/config/yaml_reader.h"

namespace tendril::app {

/// The section `motion`. A shape becomes waypoints, and a curve where it is one.
/// @param effectors  of the file
/// Real-time: no.
void read_motion(Reader& r, MotionConfig& motion, const std::vector<EffectorConfig>& effectors);

}  // namespace tendril::app
