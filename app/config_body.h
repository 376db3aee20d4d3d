#pragma once

#include <string>

#include "app/config.h"
#include "app/yaml_reader.h"

// The sections of a robot file that say what the body is made of, what moves it and what of it is controlled.
// Real-time: no, all of them (they allocate and throw ConfigError).
namespace tendril::app {

inline constexpr Range kPoissonRatio = {.at_least = 0, .below = 0.5};
inline constexpr Range kCanopenNode = {.at_least = 1, .at_most = 127};  // CiA 301
inline constexpr Range kOdriveNode = {.at_least = 0, .at_most = 63};

/// A name as robot, effectors and actuators have it: it becomes columns of tables and labels of metrics.
void read_name(const Value& v, std::string& name);

void read_mesh(Reader& r, MeshConfig& mesh);
void read_material(Reader& r, MaterialConfig& material);
void read_load(Reader& r, LoadConfig& load);
void read_region(const Value& v, RegionConfig& region);
void read_effector(Reader& r, EffectorConfig& effector);
/// @param protocol  which keys its drive may have depends on it
void read_actuator(Reader& r, ActuatorConfig& actuator, hal::Protocol protocol);

/// The way to read the value of a key that belongs to one protocol alone.
/// @param how  as for Value::read
template <class... How>
auto only_with(hal::Protocol owner, hal::Protocol protocol, const How&... how) {
  return [=](const Value& v, auto& out) -> void {
    if (protocol != owner)
      v.fail(owner == hal::Protocol::kOdrive ? "no such key, as bus.protocol is canopen"
                                             : "no such key, as bus.protocol is odrive");
    v.read(out, how...);
  };
}

}  // namespace tendril::app
