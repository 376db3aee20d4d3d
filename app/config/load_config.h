// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>

#include "app/config/config.h"
#include "hal/protocols/drive_protocols.h"

namespace tendril::app {

/// The keys a robot file may have, such as "actuators[].drive.node", and for each whether it is required.
using ConfigKeys = std::map<std::string, bool>;

/// Reads and checks one robot file: syntax, keys, units, ranges, and what one key demands of another.
/// docs/robot-file.md describes the file.
/// @param keys  where given, receives the keys that were looked for: all but those of sections that the file
/// leaves out
/// @param protocols  that the file may name, the default one first
/// @throws      ConfigError naming file, line and key, what was found and what is expected
/// Real-time: no (reads a file, allocates).
Config load_config(const std::filesystem::path& file, ConfigKeys* keys = nullptr,
                   std::span<const hal::DriveProtocol* const> protocols = hal::drive_protocols());

}  // namespace tendril::app
