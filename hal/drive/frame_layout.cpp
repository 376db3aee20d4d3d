// SPDX-License-Identifier: Apache-2.0
#include "hal/drive/frame_layout.h"

#include <algorithm>

#include "hal/drive/formatted.h"

namespace tendril::hal {
namespace {

// These leave room for the longest prefix and suffix in the 32 characters of a name.
constexpr size_t kLongestAxisName = 14;
constexpr size_t kLongestSensorName = 25;

/// Whether a DBC can have a name as the rest of an identifier.
bool fits_a_name(const std::string& name, size_t longest) {
  return name.size() <= longest && std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
         });
}

/// A signal in the unit that people read.
Signal legible(Signal signal) {
  struct Unit {
    const char *si, *name;
    double per_si;
  };
  for (const Unit& unit : {Unit{"m", "mm", 1e3}, Unit{"Pa", "kPa", 1e-3}, Unit{"s", "ms", 1e3}})
    if (signal.unit == unit.si) {
      signal.offset *= unit.per_si;
      return scaled(signal, signal.scale * unit.per_si, unit.name);
    }
  return signal;
}

}  // namespace

Signal number(const char* name, int start, int length, SignalType type) {
  return {.name = name, .start = start, .length = length, .type = type};
}

Signal scaled(Signal signal, double scale, const std::string& unit) {
  signal.scale = scale;
  signal.unit = unit;
  return signal;
}

Signal real(const char* name, int start, const char* unit) {
  return scaled(number(name, start, 32, SignalType::kFloat), 1, unit);
}

std::string node_name(const AxisConfig& axis) {
  return fits_a_name(axis.name, kLongestAxisName) ? "Drive_" + axis.name
                                                  : "Node_" + std::to_string(axis.node);
}

Signal as_displacement(Signal signal, const AxisScale& scale, const DisplacementUnit& unit) {
  signal = scaled(signal, scale.displacement_per_count() * unit.per_si, unit.name);
  signal.offset = scale.offset * unit.per_si;
  return signal;
}

FrameLayout sensor_layout(const SensorConfig& sensor) {
  const bool fits = fits_a_name(sensor.name, kLongestSensorName);
  const std::string name = "Sensor_" + (fits ? sensor.name : formatted("%X", sensor.id));
  FrameLayout layout{marked_id(sensor.id, sensor.extended), name, sensor.length, name, {}};
  for (const Signal& signal : sensor.signals) layout.signals.push_back(legible(signal));
  if (sensor.age) layout.signals.push_back(legible(*sensor.age));
  return layout;
}

}  // namespace tendril::hal
