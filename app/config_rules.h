#pragma once

#include <string>
#include <vector>

#include "app/config.h"
#include "app/yaml_reader.h"

namespace tendril::app {

/// Checks what one key of a robot file demands of another, after each has been read by itself: capacities,
/// names and CAN identifiers that are given once only, masses of parts, heartbeats, cables and rods with a
/// direction, a motion inside the workspace.
/// @param robot   the whole file, to say where a mistake is
/// @param config  what was read from it
/// @throws        ConfigError
/// Real-time: no (allocates).
void check_rules(const Value& robot, const Config& config);

/// Whose frames an 11-bit identifier already names: "the heartbeat of node 3"; empty where it is free.
/// [CiA 301, predefined connection set; ODrive CANSimple, which gives each node 32 identifiers]
/// @param nodes  ids in use on the bus; with CANopen the master's among them
/// Real-time: no (allocates).
std::string identifier_owner(hal::Protocol protocol, int identifier, const std::vector<int>& nodes);

}  // namespace tendril::app
