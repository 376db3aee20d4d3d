// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/config/config.h"
#include "app/config/yaml_reader.h"

// The sensors of a robot file. Real-time: no, all of them (they allocate and throw ConfigError).
namespace tendril::app {

/// Reads one sensor: what it measures, and where in its frame.
/// @param config  with effectors and actuators read already
void read_sensor(const Value& v, SensorConfig& sensor, const Config& config);

/// Checks what sensors demand of each other: how many, names and quantities that are given once only.
/// @param robot  the whole file, to say where a mistake is
void check_sensors(const Value& robot, const Config& config);

}  // namespace tendril::app
