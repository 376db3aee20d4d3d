// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/config/config.h"
#include "app/config/config_drive.h"
#include "app/config/yaml_reader.h"

// The sections of a robot file that say what the body is made of, what moves it and what of it is controlled.
// Real-time: no, all of them (they allocate and throw ConfigError).
namespace tendril::app {

inline constexpr Range kPoissonRatio = {.at_least = 0, .below = 0.5};

/// A name as robot, effectors and actuators have it: it becomes columns of tables and labels of metrics.
void read_name(const Value& v, std::string& name);

void read_mesh(Reader& r, MeshConfig& mesh);
void read_material(Reader& r, MaterialConfig& material);
void read_load(Reader& r, LoadConfig& load);
void read_region(const Value& v, RegionConfig& region);
void read_effector(Reader& r, EffectorConfig& effector);
/// @param protocol  which keys its drive may have depends on it
void read_actuator(Reader& r, ActuatorConfig& actuator, const SpokenProtocol& protocol);

}  // namespace tendril::app
