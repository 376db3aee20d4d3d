#include "hal/protocols/frame_layout.h"

#include <algorithm>
#include <cstdio>

#include "hal/canopen/canopen.h"
#include "hal/cia402/cia402_setup.h"

namespace tendril::hal {
namespace {

constexpr const char* kController = "Tendril";
// These leave room for the longest prefix and suffix in the 32 characters of a name.
constexpr size_t kLongestAxisName = 14;
constexpr size_t kLongestSensorName = 25;

Signal number(const char* name, int start, int length, SignalType type = SignalType::kUnsigned) {
  return {.name = name, .start = start, .length = length, .type = type};
}

Signal scaled(Signal signal, double scale, const std::string& unit) {
  signal.scale = scale;
  signal.unit = unit;
  return signal;
}

Signal real(const char* name, int start, const char* unit = "") {
  return scaled(number(name, start, 32, SignalType::kFloat), 1, unit);
}

/// Whether a DBC can have a name as the rest of an identifier.
bool fits_a_name(const std::string& name, size_t longest) {
  return name.size() <= longest && std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
         });
}

/// The axis' own name where it fits, else its node's number.
std::string node_name(const AxisConfig& axis) {
  return fits_a_name(axis.name, kLongestAxisName) ? "Drive_" + axis.name
                                                  : "Node_" + std::to_string(axis.node);
}

void append_sdo(std::vector<FrameLayout>& frames, const std::string& node, int number_of_node) {
  const std::vector<Signal> signals = {number("command", 0, 8), number("index", 8, 16),
                                       number("subindex", 24, 8), number("data", 32, 32)};
  frames.push_back({kSdoRequestBase + number_of_node, node + "_SDO_request", 8, kController, signals});
  frames.push_back({kSdoAnswerBase + number_of_node, node + "_SDO_answer", 8, node, signals});
}

/// A position of a drive as the displacement that it stands for.
Signal displacement(Signal signal, const AxisScale& scale, const DisplacementUnit& unit) {
  signal = scaled(signal, scale.displacement_per_count() * unit.per_si, unit.name);
  signal.offset = scale.offset * unit.per_si;
  return signal;
}

void append_cia402(std::vector<FrameLayout>& frames, const AxisConfig& axis, const DisplacementUnit& unit) {
  const std::string node = node_name(axis);
  const auto position = [&](const char* name) {
    return displacement(number(name, 16, 32, SignalType::kSigned), axis.scale, unit);
  };
  const bool on_efforts = axis.set_point == SetPoint::kEffort;
  const Signal torque =
      scaled(number("target_torque", 16, 16, SignalType::kSigned), 1e-3 * axis.canopen.rated_torque, "Nm");
  frames.push_back({rpdo_cob_id(axis),
                    node + "_RPDO",
                    on_efforts ? 4 : 6,
                    kController,
                    {number("controlword", 0, 16), on_efforts ? torque : position("target_position")}});
  frames.push_back({tpdo_cob_id(axis),
                    node + "_TPDO",
                    6,
                    node,
                    {number("statusword", 0, 16), position("actual_position")}});
  frames.push_back(
      {kEmergencyBase + axis.node,
       node + "_EMCY",
       8,
       node,
       {number("error_code", 0, 16), number("error_register", 16, 8), number("detail", 24, 40)}});
  append_sdo(frames, node, axis.node);
  frames.push_back({kHeartbeatBase + axis.node, node + "_heartbeat", 1, node, {number("nmt_state", 0, 8)}});
}

std::vector<Signal> odrive_heartbeat(OdriveFirmware firmware) {
  std::vector<Signal> signals = {number("axis_error", 0, 32), number("axis_state", 32, 8)};
  if (firmware == OdriveFirmware::k0_6) {
    signals.insert(signals.end(), {number("procedure_result", 40, 8), number("trajectory_done", 48, 1)});
  } else {
    signals.insert(signals.end(), {number("motor_error", 40, 1), number("encoder_error", 48, 1),
                                   number("controller_error", 56, 1), number("trajectory_done", 63, 1)});
  }
  return signals;
}

/// What axes of firmware 0.6 alone tell. @param add  as in append_odrive
void append_odrive_0_6(const auto& add, const std::string& node) {
  add(OdriveMessage::kVersion, "_version", 8, node,
      {number("protocol", 0, 8), number("hardware_major", 8, 8), number("hardware_minor", 16, 8),
       number("hardware_variant", 24, 8), number("firmware_major", 32, 8), number("firmware_minor", 40, 8),
       number("firmware_revision", 48, 8), number("firmware_unreleased", 56, 8)});
  add(OdriveMessage::kError, "_error", 8, node,
      {number("active_errors", 0, 32), number("disarm_reason", 32, 32)});
  add(OdriveMessage::kTemperature, "_temperature", 8, node,
      {real("power_stage", 0, "degC"), real("motor", 32, "degC")});
}

void append_odrive(std::vector<FrameLayout>& frames, const AxisConfig& axis, OdriveFirmware firmware,
                   const DisplacementUnit& unit) {
  const std::string node = node_name(axis);
  const double per_turn = axis.scale.displacement_per_count() * unit.per_si;
  const auto add = [&](OdriveMessage message, const char* suffix, int length, const std::string& sender,
                       std::vector<Signal> signals) {
    frames.push_back({odrive_id(axis.node, message), node + suffix, length, sender, std::move(signals)});
  };
  if (firmware == OdriveFirmware::k0_6) append_odrive_0_6(add, node);
  add(OdriveMessage::kHeartbeat, "_heartbeat", 8, node, odrive_heartbeat(firmware));
  add(OdriveMessage::kEstop, "_estop", 0, kController, {});
  add(OdriveMessage::kSetAxisState, "_state", 4, kController, {number("requested_state", 0, 32)});
  add(OdriveMessage::kEncoderEstimates, "_estimates", 8, node,
      {displacement(real("position", 0), axis.scale, unit),
       scaled(real("velocity", 32), per_turn, unit.name + "/s")});
  add(OdriveMessage::kSetControllerMode, "_mode", 8, kController,
      {number("control_mode", 0, 32), number("input_mode", 32, 32)});
  if (axis.set_point == SetPoint::kEffort)
    add(OdriveMessage::kSetInputTorque, "_input", 4, kController, {real("target_torque", 0, "Nm")});
  else
    add(OdriveMessage::kSetInputPosition, "_input", 8, kController,
        {displacement(real("target_position", 0), axis.scale, unit),
         scaled(number("velocity", 32, 16, SignalType::kSigned), 0.001 * per_turn, unit.name + "/s"),
         scaled(number("torque", 48, 16, SignalType::kSigned), 0.001, "Nm")});
  add(OdriveMessage::kSetLimits, "_limits", 8, kController,
      {real("velocity_limit", 0, "rev/s"), real("current_limit", 32, "A")});
  add(OdriveMessage::kIq, "_iq", 8, node, {real("set_point", 0, "A"), real("measured", 32, "A")});
  add(OdriveMessage::kBusVoltageCurrent, "_supply", 8, node,
      {real("voltage", 0, "V"), real("current", 32, "A")});
  add(OdriveMessage::kClearErrors, "_clear_errors", 0, kController, {});
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

FrameLayout sensor_layout(const SensorConfig& sensor) {
  char id[16];
  std::snprintf(id, sizeof id, "%X", sensor.id);
  const std::string name = "Sensor_" + (fits_a_name(sensor.name, kLongestSensorName) ? sensor.name : id);
  FrameLayout layout{marked_id(sensor.id, sensor.extended), name, sensor.length, name, {}};
  for (const Signal& signal : sensor.signals) layout.signals.push_back(legible(signal));
  if (sensor.age) layout.signals.push_back(legible(*sensor.age));
  return layout;
}

}  // namespace

std::vector<FrameLayout> frame_layouts(const MasterConfig& config,
                                       const std::vector<DisplacementUnit>& units) {
  std::vector<FrameLayout> frames;
  const bool canopen = config.protocol == Protocol::kCanopen;
  if (canopen) {
    frames.push_back({kNmtId, "NMT", 2, kController, {number("command", 0, 8), number("node", 8, 8)}});
    frames.push_back({kSyncId, "SYNC", 0, kController, {}});
    frames.push_back({kHeartbeatBase + config.canopen.master_node,
                      "Tendril_heartbeat",
                      1,
                      kController,
                      {number("nmt_state", 0, 8)}});
  }
  for (const SensorConfig& sensor : config.sensors) frames.push_back(sensor_layout(sensor));
  for (size_t i = 0; i < config.axes.size(); ++i) {
    if (canopen) {
      append_cia402(frames, config.axes[i], units.at(i));
    } else {
      append_odrive(frames, config.axes[i], config.odrive.firmware, units.at(i));
    }
  }
  return frames;
}

}  // namespace tendril::hal
