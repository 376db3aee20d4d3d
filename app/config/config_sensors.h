#pragma once

#include "app/config/config.h"
#include "app/config/yaml_reader.h"

// The sensors of a robot file. Real-time: no, all of them (they allocate and throw ConfigError).
namespace tendril::app {

/// Reads one sensor: what it measures, and where in its frame.
/// @param config  with effectors and actuators read already
void read_sensor(const Value& v, SensorConfig& sensor, const Config& config);

/// Checks what sensors demand of each other and of the bus: how many, names and quantities that are given
/// once only, identifiers that nobody else uses.
/// @param robot  the whole file, to say where a mistake is
/// @param nodes  ids in use on the bus; with CANopen the master's among them
void check_sensors(const Value& robot, const Config& config, const std::vector<int>& nodes);

}  // namespace tendril::app
