// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/config/config.h"
#include "app/config/yaml_reader.h"

namespace tendril::app {

/// Checks what one key of a robot file demands of another, after each has been read by itself: capacities,
/// names and CAN identifiers that are given once only, masses of parts, heartbeats, cables and rods with a
/// direction, a motion inside the workspace.
/// @param robot   the whole file, to say where a mistake is
/// @param config  what was read from it
/// @throws        ConfigError
/// Real-time: no (allocates).
void check_rules(const Value& robot, const Config& config);

}  // namespace tendril::app
