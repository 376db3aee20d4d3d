// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/drive/master_config.h"
#include "hal/sensor/signal.h"

/// Every frame of a robot's bus as a table, for CAN tools. Real-time: no, for all functions (they allocate).
namespace tendril::hal {

/// The content of the frames of one identifier.
struct FrameLayout {
  uint32_t id = 0;     // see marked_id
  std::string name;    // an identifier as in C, of at most 32 characters
  int length = 0;      // bytes of data
  std::string sender;  // name of a node, an identifier as in C
  std::vector<Signal> signals;
};

/// The unit of the displacement of an axis in a DBC.
struct DisplacementUnit {
  std::string name = "mm";
  double per_si = 1000;  // how many make a m, or a m³
};

/// The name of the controller as a sender.
inline constexpr const char* kController = "Tendril";

/// Signals of a layout: a whole number, a float of 32 bits, a signal with another scale and unit, and a
/// position of a drive as a displacement. Names are identifiers as in C.
Signal number(const char* name, int start, int length, SignalType type = SignalType::kUnsigned);
Signal real(const char* name, int start, const char* unit = "");
Signal scaled(Signal signal, double scale, const std::string& unit);
Signal as_displacement(Signal signal, const AxisScale& scale, const DisplacementUnit& unit);

/// The name of a drive as a sender: that of its axis where a DBC allows it, else its node number.
std::string node_name(const AxisConfig& axis);

/// The frame of a sensor.
FrameLayout sensor_layout(const SensorConfig& sensor);

/// The frames as a DBC file, which most CAN tools read.
std::string to_dbc(const std::vector<FrameLayout>& frames);

}  // namespace tendril::hal
