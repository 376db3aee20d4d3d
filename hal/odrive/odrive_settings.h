// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "hal/drive/master_config.h"

/// The settings of ODrive axes within a configuration.
namespace tendril::hal {

/// Firmware families. They differ in the heartbeat's last bytes and in what the error bits mean.
enum class OdriveFirmware : uint8_t { k0_5, k0_6 };

/// Settings of an axis. With both limits at 0 the axis keeps those that it has.
struct OdriveAxisSettings {
  double velocity_limit = 0;  // rev/s
  double current_limit = 0;   // A
  /// Whether positions count from the place of the axis at power-on; false: it has an absolute position.
  /// Must be given.
  std::optional<bool> counts_from_power_on{};
};

/// Settings of the bus. Durations in ns.
struct OdriveBusSettings {
  OdriveFirmware firmware = OdriveFirmware::k0_6;
  int64_t encoder_period_ns = 10'000'000;  // between encoder estimates, as the drives are set up
};

/// Settings of a simulated axis.
struct OdriveSimulationSettings {
  int encoder_counts = 8192;  // in a turn, > 0
};

/// The settings within a configuration, see SettingsOf.
inline constexpr SettingsOf<OdriveAxisSettings, OdriveBusSettings> odrive_settings;

}  // namespace tendril::hal
