#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/drive/master_config.h"
#include "hal/sensor/signal.h"

/// Every frame of a robot's bus as a table, for people and their tools. Real-time: no, for all of it
/// (allocates).
namespace tendril::hal {

/// What a frame of one identifier carries.
struct FrameLayout {
  uint32_t id = 0;     // see marked_id
  std::string name;    // an identifier as in C, of at most 32 characters
  int length = 0;      // bytes of data
  std::string sender;  // a node's name, likewise
  std::vector<Signal> signals;
};

/// The unit in which people read the displacement of an axis.
struct DisplacementUnit {
  std::string name = "mm";
  double per_si = 1000;  // how many make a m, or a m³
};

/// The frames of drives, controller and sensors, in the order of their identifiers' owners: those of the bus,
/// then axis by axis. Positions are in displacements, not in counts, torques in Nm.
/// @param config  as `check` of hal/protocols/drive_protocol.h wants it
/// @param units   one an axis
std::vector<FrameLayout> frame_layouts(const MasterConfig& config,
                                       const std::vector<DisplacementUnit>& units);

/// The frames as a DBC file, which most CAN tools read.
std::string to_dbc(const std::vector<FrameLayout>& frames);

}  // namespace tendril::hal
