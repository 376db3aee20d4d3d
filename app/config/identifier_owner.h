#pragma once

#include <string>
#include <vector>

#include "hal/drive/master_config.h"

namespace tendril::app {

/// Whose frames an 11-bit identifier already names: "the heartbeat of node 3"; empty where it is free.
/// [CiA 301, predefined connection set; ODrive CANSimple, which gives each node 32 identifiers]
/// @param nodes  ids in use on the bus; with CANopen the master's among them
/// Real-time: no (allocates).
std::string identifier_owner(hal::Protocol protocol, int identifier, const std::vector<int>& nodes);

}  // namespace tendril::app
