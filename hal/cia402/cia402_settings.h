// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "hal/drive/master_config.h"

/// The settings of CiA 402 drives within a configuration.
namespace tendril::hal {

/// How an axis gets its reference.
enum class Reference : uint8_t {
  kAbsolute,  // it has one at power-on, or it is set by other means
  kHoming     // by the homing procedure of the drive, at the start
};

/// The homing procedure of a drive [CiA 402-2, homing mode]. What is not given stays as the drive has it.
struct HomingConfig {
  std::optional<int8_t> method;          // 6098
  std::optional<uint32_t> speed_search;  // 6099:1, for the switch, in the drive's own unit of speed
  std::optional<uint32_t> speed_zero;    // 6099:2, for the zero, in the drive's own unit of speed
  std::optional<uint32_t> acceleration;  // 609A, in the drive's own unit of acceleration
  int64_t timeout_ns = 60'000'000'000;   // for the whole procedure
};

/// Who sets up the PDO mapping of a drive.
enum class Mapping : uint8_t {
  kConfigure,  // the master, at each start
  kAsFound     // the maker's tool; the master reads the mapping and refuses a different one
};

/// Settings of an axis.
struct Cia402AxisSettings {
  int pdo = 1;           // which pair of PDOs to use, 1..4: objects 1400 + pdo - 1 and so on
  uint32_t rpdo_id = 0;  // 11-bit COB-IDs; 0: those of the predefined connection set
  uint32_t tpdo_id = 0;
  Mapping mapping = Mapping::kConfigure;
  Reference reference = Reference::kAbsolute;
  int referenced_bit = -1;  // of the statusword, 0..15: set while the drive has a reference; -1: no such bit
  HomingConfig homing{};
  bool homing_given = false;  // the robot file has a section for it
  bool soft_limits = true;    // the limits of the displacement are written to the drive (607D)
  double rated_torque = 0;    // Nm, > 0 with SetPoint::kEffort: 1000 in 6071, at the shaft that is counted
};

/// Settings of the bus. Durations in ns.
struct Cia402BusSettings {
  int master_node = 127;
  int64_t sdo_timeout_ns = 100'000'000;  // of each attempt
  int sdo_attempts = 3;
};

/// Settings of a simulated drive.
struct Cia402SimulationSettings {
  /// Following-error window, share of the range of displacements; none: the drive does not monitor it.
  std::optional<double> following_error;
};

/// The settings within a configuration, see SettingsOf.
inline constexpr SettingsOf<Cia402AxisSettings, Cia402BusSettings> cia402_settings;

}  // namespace tendril::hal
