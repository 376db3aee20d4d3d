// SPDX-License-Identifier: Apache-2.0
#include "hal/odrive/odrive_protocol.h"

#include <cmath>

#include "hal/odrive/odrive_master.h"
#include "hal/odrive/odrive_settings.h"
#include "hal/odrive/simulated_odrive_drive.h"
#include "hal/sim/simulated_axis.h"

namespace tendril::hal {
namespace {

constexpr Range kNode = {.at_least = 0, .at_most = 63};
constexpr Range kEncoderPeriod = {.at_least = 1e-3, .at_most = 1};

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

/// What axes of firmware 0.6 alone tell. @param add  appends a frame
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

std::vector<FrameLayout> axis_layouts(const AxisConfig& axis, OdriveFirmware firmware,
                                      const DisplacementUnit& unit) {
  std::vector<FrameLayout> frames;
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
      {as_displacement(real("position", 0), axis.scale, unit),
       scaled(real("velocity", 32), per_turn, unit.name + "/s")});
  add(OdriveMessage::kSetControllerMode, "_mode", 8, kController,
      {number("control_mode", 0, 32), number("input_mode", 32, 32)});
  if (axis.set_point == SetPoint::kEffort)
    add(OdriveMessage::kSetInputTorque, "_input", 4, kController, {real("target_torque", 0, "Nm")});
  else
    add(OdriveMessage::kSetInputPosition, "_input", 8, kController,
        {as_displacement(real("target_position", 0), axis.scale, unit),
         scaled(number("velocity", 32, 16, SignalType::kSigned), 0.001 * per_turn, unit.name + "/s"),
         scaled(number("torque", 48, 16, SignalType::kSigned), 0.001, "Nm")});
  add(OdriveMessage::kSetLimits, "_limits", 8, kController,
      {real("velocity_limit", 0, "rev/s"), real("current_limit", 32, "A")});
  add(OdriveMessage::kIq, "_iq", 8, node, {real("set_point", 0, "A"), real("measured", 32, "A")});
  add(OdriveMessage::kBusVoltageCurrent, "_supply", 8, node,
      {real("voltage", 0, "V"), real("current", 32, "A")});
  add(OdriveMessage::kClearErrors, "_clear_errors", 0, kController, {});
  return frames;
}

class OdriveProtocol final : public DriveProtocol {
 public:
  std::string_view name() const override { return "odrive"; }

  void read_bus(Settings& section, MasterConfig& config) const override {
    config.heartbeat_ns = 100'000'000;  // what the drives are delivered with
    config.heartbeat_timeout_ns = 250'000'000;
    OdriveBusSettings& bus = odrive_settings(config);
    section.word("firmware", bus.firmware, {{"0.5", OdriveFirmware::k0_5}, {"0.6", OdriveFirmware::k0_6}});
    section.time("encoder_period", bus.encoder_period_ns, kEncoderPeriod);
  }

  void read_drive(Settings& section, Dimension, AxisConfig& axis) const override {
    OdriveAxisSettings& settings = odrive_settings(axis);
    section.whole("node", axis.node, kNode, Settings::Need::kRequired);
    section.refuse(
        "counts_per_turn",
        "no such key, as bus.protocol is odrive, whose positions are in turns of the encoder; gear "
        "says how many of these make one of the pulley, screw or pump");
    axis.scale.counts_per_turn = 1;
    double gear = 1;
    section.number("gear", gear, Dimension::kNumber, kPositive);
    axis.scale.displacement_per_turn /= gear;
    bool from_power_on = false;
    section.word("reference", from_power_on, {{"absolute", false}, {"power_on", true}});
    if (section.has("reference")) settings.counts_from_power_on = from_power_on;
    section.number("velocity_limit", settings.velocity_limit, Dimension::kTurnRate, kPositive);
    section.number("current_limit", settings.current_limit, Dimension::kCurrent, kPositive);
  }

  void read_simulation(Settings& section, std::any& protocol_settings) const override {
    section.whole("encoder_counts", settings_as<OdriveSimulationSettings>(protocol_settings).encoder_counts,
                  Range{.at_least = 1});
  }

  void check(const MasterConfig& config) const override { check_odrive(config); }

  std::vector<std::string> warnings(const MasterConfig& config) const override {
    std::string names;
    for (const AxisConfig& axis : config.axes)
      if (odrive_settings(axis).counts_from_power_on.value_or(false))
        names += (names.empty() ? "'" : ", '") + axis.name + "'";
    if (names.empty()) return {};
    return {
        "drive.reference is power_on of " + names +
        ": these must get power where their displacement is drive.offset, in the shape of the mesh unless "
        "it is given; nothing else tells where they stand"};
  }

  std::vector<PeriodicFrames> periodic_frames(const MasterConfig& config) const override {
    return odrive_frames(config);
  }

  std::vector<FrameLayout> drive_layouts(const MasterConfig& config, int axis,
                                         const DisplacementUnit& unit) const override {
    return axis_layouts(config.axes[axis], odrive_settings(config).firmware, unit);
  }

  std::unique_ptr<DriveMaster> make_master(const MasterConfig& config) const override {
    return std::make_unique<OdriveMaster>(config);
  }

  std::unique_ptr<SimulatedDrive> make_simulated_drive(const MasterConfig& config, int axis,
                                                       const SimulatedActuator& actuator) const override {
    const AxisConfig& a = config.axes[axis];
    return std::make_unique<SimulatedAxis<SimulatedOdriveDrive>>(
        SimulatedOdriveSpec{
            .node = a.node,
            .firmware = odrive_settings(config).firmware,
            .top_speed = actuator.top_rate / std::abs(a.scale.displacement_per_count()),
            .position = a.scale.to_position(actuator.displacement),
            .tuning = tuned(SimulatedOdriveSpec{}.tuning, actuator),
            .torque_limit = std::abs(a.scale.to_torque(actuator.force_limit)),
            .encoder_counts =
                settings_as<OdriveSimulationSettings>(actuator.protocol_settings).encoder_counts,
            .heartbeat_ns = config.heartbeat_ns,
            .encoder_period_ns = odrive_settings(config).encoder_period_ns,
            .watchdog_ns = config.heartbeat_timeout_ns,
            .left_enabled = actuator.left_enabled},
        a.scale, actuator.force_limit, odrive_id(a.node, OdriveMessage::kHeartbeat));
  }

  FaultInjection fault_injection() const override {
    return {"error", "its axis fails with those error bits (from 0x1 on)", UINT32_MAX};
  }
};

}  // namespace

const DriveProtocol& odrive_protocol() {
  static const OdriveProtocol protocol;
  return protocol;
}

}  // namespace tendril::hal
