#pragma once

#include <functional>
#include <string_view>

#include "app/config/config.h"
#include "app/config/yaml_reader.h"

namespace tendril::app {

inline constexpr Range kCanopenNode = {.at_least = 1, .at_most = 127};  // CiA 301
inline constexpr Range kOdriveNode = {.at_least = 0, .at_most = 63};

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

/// The way to read the section `drive` of an actuator.
/// @param protocol   which keys it may have depends on it
/// @param key        that says what a turn of the drive is worth
/// @param dimension  of that and of displacements: a length or a volume
/// @param factor     from the key's value to the displacement of a turn
/// @return           for Reader::need. Real-time: no (allocates, throws ConfigError)
std::function<void(Reader&, DriveConfig&)> drive_of(hal::Protocol protocol, std::string_view key,
                                                    Dimension dimension, double factor = 1);

}  // namespace tendril::app
