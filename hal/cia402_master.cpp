#include "hal/cia402_master.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "hal/tracker.h"

namespace tendril::hal {
namespace {

// Axes set up at the same time: their SDO traffic must fit in a cycle beside the PDOs of those that run.
constexpr int kSetUpAtOnce = 4;

FaultKind fault_of(BusHealth health) noexcept {
  switch (health) {
    case BusHealth::kActive:
      return FaultKind::kNone;
    case BusHealth::kPassive:
      return FaultKind::kBusPassive;
    case BusHealth::kOff:
      return FaultKind::kBusOff;
    case BusHealth::kDown:
      break;
  }
  return FaultKind::kBusDown;
}

MasterConfig checked(MasterConfig config) {
  check(config);
  return config;
}

std::string format(const char* pattern, auto... values) {
  char text[160];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

}  // namespace

Cia402Master::Cia402Master(MasterConfig config) : config_(checked(std::move(config))) {
  axes_.reserve(config_.axes.size());
  for (const AxisConfig& axis : config_.axes) axes_.emplace_back(axis, config_);
  measurement_.axes = static_cast<int>(axes_.size());
}

std::vector<uint32_t> Cia402Master::identifiers() const {
  std::vector<uint32_t> ids;
  if (config_.tracker_id != 0) ids.push_back(config_.tracker_id);
  for (const AxisConfig& axis : config_.axes)
    for (const uint32_t base : {kEmergencyBase, kSdoAnswerBase, kHeartbeatBase})
      ids.push_back(base + axis.node);
  for (const AxisConfig& axis : config_.axes) ids.push_back(axis.tpdo_cob_id());
  return ids;
}

void Cia402Master::receive(const Frame& frame, int64_t arrival_ns) noexcept {
  if (config_.tracker_id != 0 && frame.id == config_.tracker_id && !frame.extended) {
    if (const auto sample = decode_tracker(frame)) {
      measurement_.tracker_position = sample->position;
      measurement_.tracker_stamp_ns = arrival_ns - sample->age_ns;
    }
    return;
  }
  for (Cia402Axis& axis : axes_) axis.receive(frame, arrival_ns);
}

const Measurement& Cia402Master::measure(BusHealth health, int64_t now_ns) noexcept {
  Measurement& m = measurement_;
  m.stamp_ns = now_ns;
  m.all_known = m.all_enabled = m.all_disabled = m.finished = true;
  latch({.kind = fault_of(health)});
  for (int i = 0; i < m.axes; ++i) {
    Cia402Axis& axis = axes_[i];
    axis.supervise(now_ns, synced_ns_);
    m.position[i] = axis.position();
    m.position_stamp_ns[i] = axis.position_stamp_ns();
    m.all_known = m.all_known && axis.known(synced_ns_);
    m.all_enabled = m.all_enabled && axis.enabled();
    m.all_disabled = m.all_disabled && axis.disabled();
    m.finished = m.finished && axis.finished();
    DriveFault fault = axis.fault();
    fault.axis = i;
    latch(fault);
  }
  m.tracker_fresh = m.tracker_stamp_ns != 0 && now_ns - m.tracker_stamp_ns <= config_.tracker_timeout_ns;
  return m;
}

void Cia402Master::command(const Command& command, int64_t now_ns, FrameBatch& out) noexcept {
  if (command.reset && measurement_.fault.kind != FaultKind::kNone) clear_faults();
  if (now_ns >= next_heartbeat_ns_) {
    out.push(encode_heartbeat(config_.master_node, NmtState::kOperational));
    next_heartbeat_ns_ = now_ns + config_.heartbeat_ns;
  }
  if (command.finish && !command.enable && measurement_.all_disabled)
    for (Cia402Axis& axis : axes_) axis.release(out);
  set_up(now_ns, out);
  const bool may_begin = measurement_.all_known && measurement_.fault.kind == FaultKind::kNone;
  for (int i = 0; i < measurement_.axes; ++i)
    axes_[i].drive(command.enable, may_begin, measurement_.all_enabled, command.position[i], now_ns, out);
  if (std::any_of(axes_.begin(), axes_.end(), [](const Cia402Axis& axis) { return axis.synchronous(); })) {
    out.push(encode_sync());
    synced_ns_ = now_ns;
  }
}

void Cia402Master::set_up(int64_t now_ns, FrameBatch& out) noexcept {
  int busy = 0;
  for (Cia402Axis& axis : axes_)
    if (!axis.setting_up() || ++busy <= kSetUpAtOnce) axis.set_up(now_ns, out);
}

void Cia402Master::latch(const DriveFault& fault) noexcept {
  DriveFault& latched = measurement_.fault;
  const bool same = latched.kind == fault.kind && latched.axis == fault.axis;
  // The same fault again may bring the error code, where the statusword was faster than the EMCY.
  if (latched.kind == FaultKind::kNone || same) latched = fault;
}

void Cia402Master::clear_faults() noexcept {
  measurement_.fault = {};
  for (Cia402Axis& axis : axes_)
    if (axis.fault().kind != FaultKind::kNone) axis.restart();
}

std::string Cia402Master::describe(const DriveFault& fault) const {
  const char* kind = hal::describe(fault.kind);
  if (fault.axis < 0 || fault.axis >= measurement_.axes) return kind;
  const AxisConfig& axis = config_.axes[fault.axis];
  const std::string who = "axis " + std::to_string(fault.axis) + " '" + axis.name + "' (node " +
                          std::to_string(axis.node) + "): ";
  switch (fault.kind) {
    case FaultKind::kConfiguration:
      return who + kind + format(" at object %04X:%u: ", fault.object >> 8, fault.object & 0xFF) +
             (fault.code == 0 ? "reads back another value than was written"
                              : format("%s (SDO abort %08X)", describe_sdo_abort(fault.code), fault.code));
    case FaultKind::kDriveFault:
      if (fault.code == 0) return who + kind + ", no error code received";
      return who + kind +
             format(": %s (EMCY %04X)", describe_emergency(static_cast<uint16_t>(fault.code)), fault.code);
    case FaultKind::kEnableTimeout:
    case FaultKind::kDriveDisabled:
      return who + kind +
             format(", it is in '%s' (statusword %04X)",
                    to_text(decode_statusword(static_cast<uint16_t>(fault.code))), fault.code);
    case FaultKind::kStartTimeout:
    case FaultKind::kDriveRestarted:
      return who + kind + format(" (NMT state %02X)", fault.code);
    default:
      return who + kind;
  }
}

}  // namespace tendril::hal
