// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "app/config/config.h"
#include "hal/bus/bus_budget.h"

namespace tendril::app {

/// What the frames of a running robot need of its bus, at worst.
/// @throws ConfigError where they cannot fit the bit rate
/// Real-time: no.
hal::BusBudget check_bus(const Config& config);

/// What a person must know of the drives' settings at each start, and what is worth a second look, a sentence
/// each. Real-time: no (allocates).
std::vector<std::string> warnings_on_drives(const Config& config);
std::vector<std::string> advice_on_drives(const Config& config);

/// What a person must know of a transmit queue that cannot hold the frames of a cycle; empty where it can.
/// @param bus     the interface that is used
/// @param frames  of its transmit queue, 0: no limit, see hal::Bus::transmit_queue
/// Real-time: no (allocates).
std::string warning_on_queue(const Config& config, const std::string& bus, int frames);

/// Every frame of the robot's bus as a DBC file.
/// @throws ConfigError as `check_bus`
/// Real-time: no.
std::string bus_dbc(const Config& config);

}  // namespace tendril::app
