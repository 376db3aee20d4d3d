#pragma once

#include <string>

#include "app/config/config.h"
#include "hal/bus/bus_budget.h"

namespace tendril::app {

/// What the frames of a running robot need of its bus, at worst.
/// @throws ConfigError where they cannot fit the bit rate, or two senders share an identifier
/// Real-time: no.
hal::BusBudget check_bus(const Config& config);

/// What a person must see to where axes count from wherever they stood when they got power; empty where none
/// do. Real-time: no (allocates).
std::string advice_on_power_on(const Config& config);

/// Every frame of the robot's bus as a DBC file.
/// @throws ConfigError as `check_bus`
/// Real-time: no.
std::string bus_dbc(const Config& config);

}  // namespace tendril::app
