// SPDX-License-Identifier: Apache-2.0
#include "hal/odrive/odrive_master.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "hal/drive/following_monitor.h"
#include "hal/drive/formatted.h"

namespace tendril::hal {
namespace {

// Axes for which closed-loop control is requested in one cycle, four frames each; any other axis has two at
// most: see frames_in_cycle.
constexpr int kRequestsInOneCycle = 2;

void check_axis(const MasterConfig& config, int i) {
  const AxisConfig& axis = config.axes[i];
  const OdriveAxisSettings& settings = odrive_settings(axis);
  if (axis.node < 0 || axis.node >= kOdriveNodes) refuse_drive(config, i, "node", "a node id from 0 to 63");
  if (axis.node == kOdriveUnaddressed && odrive_settings(config).firmware == OdriveFirmware::k0_6)
    refuse_drive(config, i, "node", "at most 62, as firmware 0.6 gives 63 to axes that have no address yet");
  // The protocol does not report whether there is a reference, so the robot file must.
  if (!settings.counts_from_power_on)
    refuse_drive(config, i, "reference",
                 "absolute, or power_on: does the axis still know where it stands when its power was off, or "
                 "does it count from wherever it stands when the power comes? An ODrive does not tell");
  if (axis.scale.counts_per_turn != 1)
    refuse_drive(config, i, "counts_per_turn", "1, as positions are in turns");
  const bool has_velocity = settings.velocity_limit > 0, has_current = settings.current_limit > 0;
  if (settings.velocity_limit < 0 || (has_current && !has_velocity))
    refuse_drive(config, i, "velocity_limit", "a velocity limit beside the current limit");
  if (settings.current_limit < 0 || (has_velocity && !has_current))
    refuse_drive(config, i, "current_limit", "a current limit beside the velocity limit");
}

MasterConfig checked_odrive(MasterConfig config) {
  check_odrive(config);
  return config;
}

/// Identifiers of frames that a running controller repeats: it feeds the watchdogs with them.
std::vector<uint32_t> controller_ids(const MasterConfig& config) {
  std::vector<uint32_t> ids;
  for (const AxisConfig& axis : config.axes)
    for (const OdriveMessage message : {OdriveMessage::kSetAxisState, OdriveMessage::kSetControllerMode,
                                        OdriveMessage::kSetInputPosition, OdriveMessage::kSetInputTorque})
      ids.push_back(odrive_id(axis.node, message));
  return ids;
}

std::string words_of_components(uint8_t components) {
  std::string words;
  if (components & 1) words += ", its motor has an error";
  if (components & 2) words += ", its encoder has an error";
  if (components & 4) words += ", its controller has an error";
  return words;
}

}  // namespace

void check_odrive(const MasterConfig& config) {
  const int64_t encoder_period_ns = odrive_settings(config).encoder_period_ns;
  if (encoder_period_ns < 1'000'000) refuse_bus("encoder_period", "at least 1 ms");
  check_common(config, encoder_period_ns);
  for (int i = 0; i < static_cast<int>(config.axes.size()); ++i) check_axis(config, i);
  IdentifierClaims claims;
  for (const AxisConfig& axis : config.axes)
    for (uint32_t message = 0; message < 32; ++message) {
      const uint32_t id = static_cast<uint32_t>(axis.node) << 5 | message;
      claims.claim(id, label(axis));
      claims.reserve(id, formatted("message 0x%02X of node %d", message, axis.node));
    }
  claims.claim_sensors(config);
}

std::vector<PeriodicFrames> odrive_frames(const MasterConfig& config) {
  const int axes = static_cast<int>(config.axes.size());
  const auto rate_hz = [](int64_t period_ns) { return 1e9 / static_cast<double>(period_ns); };
  const auto on_efforts =
      static_cast<int>(std::ranges::count(config.axes, SetPoint::kEffort, &AxisConfig::set_point));
  return {{.length = 8, .rate_hz = rate_hz(config.period_ns), .count = axes - on_efforts},  // positions
          {.length = 4, .rate_hz = rate_hz(config.period_ns), .count = on_efforts},         // torques
          {.length = 8, .rate_hz = rate_hz(odrive_settings(config).encoder_period_ns), .count = axes},
          {.length = 8, .rate_hz = rate_hz(config.heartbeat_ns), .count = axes}};
}

std::array<uint32_t, 2> received_odrive_ids(const AxisConfig& axis) noexcept {
  return {odrive_id(axis.node, OdriveMessage::kHeartbeat),
          odrive_id(axis.node, OdriveMessage::kEncoderEstimates)};
}

OdriveMaster::OdriveMaster(MasterConfig config)
    : config_(checked_odrive(std::move(config))),
      axis_table_(config_.axes, received_odrive_ids),
      supervisor_(config_, controller_ids(config_)) {
  axes_.reserve(config_.axes.size());
  for (const AxisConfig& axis : config_.axes) axes_.emplace_back(axis, config_);
}

std::vector<uint32_t> OdriveMaster::identifiers() const {
  std::vector<uint32_t> ids = supervisor_.identifiers();
  std::ranges::copy(controller_ids(config_), std::back_inserter(ids));
  for (const AxisConfig& axis : config_.axes)
    for (const uint32_t id : received_odrive_ids(axis)) ids.push_back(id);
  return ids;
}

void OdriveMaster::receive(const Frame& frame, int64_t arrival_ns) noexcept {
  if (supervisor_.receive(frame, arrival_ns)) return;
  const int axis = axis_table_.find(frame);
  if (axis != AxisTable::kNoAxis) axes_[axis].receive(frame, arrival_ns);
}

const Measurement& OdriveMaster::measure(BusHealth health, int64_t now_ns) noexcept {
  return supervisor_.measure(axes_, health, now_ns, now_ns);  // estimates come without SYNC
}

void OdriveMaster::command(const Command& command, int64_t now_ns, FrameBatch& out) noexcept {
  if (command.reset) supervisor_.reset(axes_);
  if (!supervisor_.may_send(now_ns)) return;
  const Measurement& known = supervisor_.measurement();
  if (command.finish && !command.enable && known.all_disabled)
    for (OdriveAxis& axis : axes_) axis.release();
  const bool may_begin = known.all_known && !supervisor_.faulted();
  int requests = 0;
  for (int i = 0; i < known.axes; ++i) {
    const bool may_request = !axes_[i].ready_for_closed_loop() || ++requests <= kRequestsInOneCycle;
    axes_[i].drive(command.enable, may_begin, may_request, known.all_enabled,
                   {command.displacement[i], command.effort[i]}, now_ns, out);
  }
}

std::string OdriveMaster::describe(const DriveFault& fault) const {
  const std::string kind = name(fault.kind);
  if (fault.kind == FaultKind::kOtherMaster) return describe_other_master(fault);
  if (fault.axis < 0 || fault.axis >= static_cast<int>(axes_.size())) return kind;
  const std::string who = label(config_, fault.axis) + ": ";
  const OdriveFirmware firmware = odrive_settings(config_).firmware;
  switch (fault.kind) {
    case FaultKind::kDriveFault:
      return who + kind + ": " + describe_odrive_error(firmware, fault.code) +
             formatted(" (axis error %08X)", fault.code);
    case FaultKind::kStartTimeout:
      return who + kind +
             (fault.code == 0 ? ", no heartbeat was heard"
                              : ", its heartbeat was heard, but no position (encoder estimates)");
    case FaultKind::kEnableTimeout:
    case FaultKind::kDriveDisabled: {
      const std::string result =
          firmware == OdriveFirmware::k0_6
              ? std::string(", result '") + describe_odrive_result(OdriveAxis::result_of(fault.code)) + "'"
              : "";
      return who + kind + ", it is in '" + describe_odrive_axis_state(OdriveAxis::state_of(fault.code)) +
             "'" + result + words_of_components(OdriveAxis::components_of(fault.code));
    }
    case FaultKind::kPositionJumped:
      return who + kind +
             formatted(" by %.3f turns: has it a reference?", 1e-3 * static_cast<int32_t>(fault.code));
    case FaultKind::kNotFollowing:
    case FaultKind::kFeedbackJumped:
      return who + describe_motion_fault(config_.axes[fault.axis], fault);
    case FaultKind::kOutOfRange:
      return who + describe_out_of_range(fault);
    default:
      return who + kind;
  }
}

}  // namespace tendril::hal
