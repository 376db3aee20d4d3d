// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

#include "app/config/config.h"

namespace tendril::app {

/// A line that is no fault; what() says what is expected in its place.
struct PlantFaultMistake : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads a line such as "heartbeat north off", "delay 5 ms" or "drop 10 %".
/// @param config  the robot: names of actuators and sensors; codes of drive faults are EMCY codes or an
/// ODrive axis' error bits
/// @throws PlantFaultMistake
/// Real-time: no (allocates).
PlantFault parse_plant_fault(std::string_view line, const Config& config);

/// All lines that parse_plant_fault takes, each with what it does, for people.
/// Real-time: no (allocates).
std::string plant_fault_help(const hal::DriveProtocol& protocol);

}  // namespace tendril::app
