// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string_view>

#include "app/config/config.h"
#include "app/config/protocol_settings.h"
#include "app/config/yaml_reader.h"

namespace tendril::app {

/// The protocol of the bus, and those that robot files may name.
struct SpokenProtocol {
  const hal::DriveProtocol& spoken;
  Protocols known;
};

/// The way to read the section `drive` of an actuator.
/// @param protocol   which keys it may have depends on it
/// @param key        that says what a turn of the drive is worth
/// @param dimension  of that and of displacements: a length or a volume
/// @param factor     from the key's value to the displacement of a turn
/// @return           for Reader::need. Real-time: no (allocates, throws ConfigError)
std::function<void(Reader&, hal::AxisConfig&)> drive_of(const SpokenProtocol& protocol, std::string_view key,
                                                        Dimension dimension, double factor = 1);

}  // namespace tendril::app
