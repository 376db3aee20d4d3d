// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/drive/drive_protocol.h"
#include "hal/drive/drives.h"

namespace tendril::fuzz {

/// What a protocol's frames say, for the laws that hold for all protocols.
struct Language {
  const hal::DriveProtocol* protocol;

  /// Configurations, each of another kind of axes.
  std::vector<hal::MasterConfig> (*configs)();

  /// Whether the drive of an axis says in this frame that it is enabled; nothing where it says nothing of it.
  std::optional<bool> (*says_enabled)(const hal::MasterConfig&, const hal::AxisConfig&, const hal::Frame&);

  /// Whether the frame asks the drive of an axis to be enabled.
  bool (*asks_for_power)(const hal::MasterConfig&, const hal::AxisConfig&, const hal::Frame&);

  /// Whether all numbers in a frame of the master are finite.
  bool (*is_finite)(const hal::MasterConfig&, const hal::AxisConfig&, const hal::Frame&);
};

/// Feeds an input to a master and its simulated drives: what is lost and damaged on the bus between them,
/// frames of others, what the master is commanded, and what happens to the drives.
bool feed_bus(const Language& language, const std::string& bytes);

/// A configuration without the settings of a protocol: two axes with nodes 1 and 2, and a camera.
hal::MasterConfig two_axes(const hal::DriveProtocol& protocol);

}  // namespace tendril::fuzz
