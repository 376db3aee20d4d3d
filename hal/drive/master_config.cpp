// SPDX-License-Identifier: Apache-2.0
#include "hal/drive/master_config.h"

#include <cmath>

#include "hal/drive/drives.h"
#include "hal/drive/formatted.h"

namespace tendril::hal {
namespace {

using Section = SettingError::Section;

void check_axis(const MasterConfig& config, int i, int node_of_master) {
  const AxisConfig& axis = config.axes[i];
  if (!(axis.scale.counts_per_turn > 0)) refuse_drive(config, i, "counts_per_turn", "a number above 0");
  if (!(axis.scale.displacement_per_turn > 0))
    refuse_drive(config, i, "displacement_per_turn", "a displacement per turn above 0");
  if (!(axis.displacement_min <= axis.displacement_max))
    refuse_drive(config, i, "stroke", "a least displacement that does not exceed the greatest");
  const bool limited = std::isfinite(axis.displacement_min) && std::isfinite(axis.displacement_max);
  if (axis.set_point == SetPoint::kEffort && !limited)
    refuse_drive(config, i, "stroke", "limits of the displacement, as it follows efforts");
  if (!(axis.following_error >= 0))
    refuse_drive(config, i, "following_error", "a limit that is not negative");
  if (axis.node == node_of_master)
    refuse_drive(config, i, "node", "a node id of its own, the controller (bus.master_node) has this one");
  for (int other = 0; other < i; ++other)
    if (config.axes[other].node == axis.node)
      refuse_drive(config, i, "node",
                   "a node id of its own, the drive of '" + config.axes[other].name + "' has this one");
}

/// A time in s as a robot file has it: "0.1 s".
std::string seconds(int64_t time_ns) { return formatted("%g s", 1e-9 * static_cast<double>(time_ns)); }

}  // namespace

void refuse_bus(const std::string& key, const std::string& expected) {
  throw SettingError(Section::kBus, 0, "bus: ", key, expected);
}

void refuse_drive(const MasterConfig& config, int axis, const std::string& key, const std::string& expected) {
  throw SettingError(Section::kDrive, axis, label(config.axes[axis]) + ": ", key, expected);
}

void refuse_sensor(const MasterConfig& config, int sensor, const std::string& key,
                   const std::string& expected) {
  throw SettingError(Section::kSensor, sensor, "sensor '" + config.sensors[sensor].name + "': ", key,
                     expected);
}

std::string label(const AxisConfig& axis) {
  return "axis '" + axis.name + "' (node " + std::to_string(axis.node) + ")";
}

std::string label(const MasterConfig& config, int axis) {
  const AxisConfig& a = config.axes[axis];
  return "axis " + std::to_string(axis) + " '" + a.name + "' (node " + std::to_string(a.node) + ")";
}

std::string displacement_text(const AxisConfig& axis, double displacement) {
  return axis.moves_volume ? formatted("%.4g ml", 1e6 * displacement)
                           : formatted("%.4g mm", 1e3 * displacement);
}

void check_common(const MasterConfig& config, int64_t feedback_period_ns, int node_of_master) {
  if (config.axes.empty() || config.axes.size() > kMaxAxes)
    throw std::invalid_argument("drives: there must be 1.." + std::to_string(kMaxAxes) + " axes, not " +
                                std::to_string(config.axes.size()));
  if (config.period_ns < 50'000 || config.period_ns > 1'000'000'000)
    throw std::invalid_argument("drives: the control period must be within 0.05 ms..1 s");
  for (int i = 0; i < static_cast<int>(config.axes.size()); ++i) check_axis(config, i, node_of_master);
  // One late heartbeat is jitter, two are a fault.
  if (config.heartbeat_timeout_ns < 2 * config.heartbeat_ns)
    refuse_bus("heartbeat_timeout", "at least two heartbeats, " + seconds(2 * config.heartbeat_ns) +
                                        " (it is " + seconds(config.heartbeat_timeout_ns) + ")");
  // What the drives watch is sent in the cycles of the control loop, and one of these may fail.
  if (config.heartbeat_timeout_ns < 3 * config.period_ns)
    refuse_bus("heartbeat_timeout", "at least three control periods, " + seconds(3 * config.period_ns) +
                                        ", as the drives hear of the controller once in each (it is " +
                                        seconds(config.heartbeat_timeout_ns) + ")");
  if (config.feedback_timeout_ns < 2 * feedback_period_ns)
    refuse_bus("feedback_timeout", "at least two positions' time, " + seconds(2 * feedback_period_ns) +
                                       " (it is " + seconds(config.feedback_timeout_ns) + ")");
  check(config.sensors);
}

void IdentifierClaims::claim(uint32_t id, const std::string& user) {
  const auto [first, free] = users_.emplace(id, user);
  if (free) return;
  throw std::invalid_argument("drives: " + first->second + " and " + user +
                              formatted(" would both use identifier 0x%X", id & ~kExtendedMark));
}

void IdentifierClaims::claim_sensors(const MasterConfig& config) {
  for (int i = 0; i < static_cast<int>(config.sensors.size()); ++i) {
    const SensorConfig& sensor = config.sensors[i];
    const auto [first, free] =
        users_.emplace(marked_id(sensor.id, sensor.extended), "that of sensor '" + sensor.name + "'");
    if (!free) refuse_sensor(config, i, "id", "an identifier that is free; this is " + first->second);
  }
}

}  // namespace tendril::hal
