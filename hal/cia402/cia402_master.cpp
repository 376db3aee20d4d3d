// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/cia402_master.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "hal/canopen/canopen.h"
#include "hal/canopen/emergency.h"
#include "hal/cia402/cia402_check.h"
#include "hal/cia402/cia402_setup.h"
#include "hal/drive/following_monitor.h"
#include "hal/drive/formatted.h"

namespace tendril::hal {
namespace {

// Axes that are set up at the same time: their SDO frames must fit into a cycle beside the PDOs.
constexpr int kSetUpAtOnce = 4;

// How long drives may take to disable by PDO.
constexpr int64_t kDisableByPdo_ns = 300'000'000;

constexpr uint32_t kStatuswordObject = 0x6041'00;

MasterConfig checked_canopen(MasterConfig config) {
  check_cia402(config);
  return config;
}

/// Identifiers of frames that a running controller repeats: SYNC, its heartbeat, RPDOs.
std::vector<uint32_t> controller_ids(const MasterConfig& config) {
  std::vector<uint32_t> ids = {kSyncId, kHeartbeatBase + cia402_settings(config).master_node};
  for (const AxisConfig& axis : config.axes) ids.push_back(rpdo_cob_id(axis));
  return ids;
}

/// "object 1600:2 (the second object in RPDO 1)".
std::string object_text(uint32_t object) {
  return formatted("object %04X:%u", object >> 8, object & 0xFF) + describe_set_up_object(object);
}

}  // namespace

Cia402Master::Cia402Master(MasterConfig config)
    : config_(checked_canopen(std::move(config))),
      master_node_(cia402_settings(config_).master_node),
      axis_table_(config_.axes, received_cia402_ids),
      supervisor_(config_, controller_ids(config_)) {
  axes_.reserve(config_.axes.size());
  for (const AxisConfig& axis : config_.axes) axes_.emplace_back(axis, config_);
}

std::vector<uint32_t> Cia402Master::identifiers() const {
  std::vector<uint32_t> ids = supervisor_.identifiers();
  std::ranges::copy(controller_ids(config_), std::back_inserter(ids));
  for (const AxisConfig& axis : config_.axes)
    for (const uint32_t id : received_cia402_ids(axis)) ids.push_back(id);
  return ids;
}

void Cia402Master::receive(const Frame& frame, int64_t arrival_ns) noexcept {
  if (supervisor_.receive(frame, arrival_ns)) return;
  const int axis = axis_table_.find(frame);
  if (axis != AxisTable::kNoAxis) axes_[axis].receive(frame, arrival_ns);
}

const Measurement& Cia402Master::measure(BusHealth health, int64_t now_ns) noexcept {
  return supervisor_.measure(axes_, health, now_ns, last_sync_ns_);
}

void Cia402Master::command(const Command& command, int64_t now_ns, FrameBatch& out) noexcept {
  if (command.reset) supervisor_.reset(axes_);
  if (!supervisor_.may_send(now_ns)) return;
  const Measurement& known = supervisor_.measurement();
  if (now_ns >= next_heartbeat_ns_) {
    out.push(encode_heartbeat(master_node_, NmtState::kOperational));
    next_heartbeat_ns_ = now_ns + config_.heartbeat_ns;
    for (Cia402Axis& axis : axes_) axis.on_heartbeat_sent();
  }
  const bool finishes = command.finish && !command.enable;
  if (!finishes) finish_since_ns_ = 0;
  if (finishes && may_release(now_ns))
    for (Cia402Axis& axis : axes_) axis.release();
  set_up(now_ns, out);
  const bool may_begin = known.all_known && !supervisor_.faulted();
  const int homing = command.finish ? -1 : axis_to_home();
  const auto task = command.enable ? Cia402Axis::Task::kFollow : Cia402Axis::Task::kDisable;
  for (int i = 0; i < known.axes; ++i)
    axes_[i].drive(i == homing ? Cia402Axis::Task::kHome : task, i == homing || may_begin, known.all_enabled,
                   {command.displacement[i], command.effort[i]}, now_ns, out);
  if (std::any_of(axes_.begin(), axes_.end(), [](const Cia402Axis& axis) { return axis.synchronous(); })) {
    out.push(encode_sync());
    last_sync_ns_ = now_ns;
  }
}

/// Drives that have not disabled by PDO in time are told over SDO.
bool Cia402Master::may_release(int64_t now_ns) noexcept {
  if (finish_since_ns_ == 0) finish_since_ns_ = now_ns;
  return supervisor_.measurement().all_disabled || now_ns - finish_since_ns_ > kDisableByPdo_ns;
}

void Cia402Master::set_up(int64_t now_ns, FrameBatch& out) noexcept {
  int busy = 0;
  for (Cia402Axis& axis : axes_)
    if (!axis.setting_up() || ++busy <= kSetUpAtOnce) axis.set_up(now_ns, out);
  for (size_t i = 0; i < axes_.size(); ++i)
    if (axes_[i].names().known()) identified_[i].store(true, std::memory_order_release);
}

/// @return the axis whose turn it is; -1: none, or not yet
int Cia402Master::axis_to_home() const noexcept {
  const bool all_there = std::all_of(
      axes_.begin(), axes_.end(), [this](const Cia402Axis& axis) { return axis.connected(last_sync_ns_); });
  if (!all_there || supervisor_.faulted()) return -1;
  for (size_t i = 0; i < axes_.size(); ++i)
    if (axes_[i].needs_homing()) return static_cast<int>(i);
  return -1;
}

std::string Cia402Master::identity(int axis) const {
  if (!identified_[static_cast<size_t>(axis)].load(std::memory_order_acquire)) return "";
  return label(config_, axis) + ": " + axes_[static_cast<size_t>(axis)].names().text();
}

std::string Cia402Master::describe(const DriveFault& fault) const {
  if (fault.emergency == 0) return describe_alone(fault);
  return describe_alone(fault) +
         formatted("; before, it sent EMCY %04X: %s", fault.emergency, describe_emergency(fault.emergency));
}

std::string Cia402Master::describe_alone(const DriveFault& fault) const {
  const char* kind = name(fault.kind);
  if (fault.kind == FaultKind::kOtherMaster) return describe_other_master(fault);
  if (fault.axis < 0 || fault.axis >= static_cast<int>(axes_.size())) return kind;
  const std::string who = label(config_, fault.axis) + ": ";
  switch (fault.kind) {
    case FaultKind::kConfiguration:
      if (fault.code == code(SdoAbort::kTimeout))
        return who + formatted("node %d does not answer, asked for ", config_.axes[fault.axis].node) +
               object_text(fault.object) + ": is it on, and at this bit rate?";
      return who + kind + " at " + object_text(fault.object) +
             formatted(": %s (SDO abort %08X)", describe_sdo_abort(fault.code), fault.code);
    case FaultKind::kUnexpectedValue:
      if (fault.object == kStatuswordObject)
        return who + formatted("it has power before it is enabled, and does not lose it (statusword %04X)",
                               fault.code);
      return who + kind + ": " + object_text(fault.object) +
             formatted(" reads 0x%X and must read 0x%X", fault.code, fault.expected);
    case FaultKind::kDriveFault:
      if (fault.code == 0) return who + kind + ", no error code received";
      return who + kind +
             formatted(": %s (EMCY %04X)", describe_emergency(static_cast<uint16_t>(fault.code)), fault.code);
    case FaultKind::kEnableTimeout:
    case FaultKind::kDriveDisabled:
      return who + kind +
             formatted(", it is in '%s' (statusword %04X)",
                       name(decode_statusword(static_cast<uint16_t>(fault.code))), fault.code);
    case FaultKind::kNotReferenced:
      return who + kind +
             formatted(": bit %d of its statusword is not set (statusword %04X)",
                       cia402_settings(config_.axes[fault.axis]).referenced_bit, fault.code);
    case FaultKind::kNotFollowing:
    case FaultKind::kFeedbackJumped:
      return who + describe_motion_fault(config_.axes[fault.axis], fault);
    case FaultKind::kOutOfRange:
      return who + describe_out_of_range(fault);
    case FaultKind::kHomingFailed:
    case FaultKind::kHomingTimeout:
      return who + kind + formatted(" (statusword %04X)", fault.code);
    case FaultKind::kStartTimeout:
    case FaultKind::kDriveRestarted:
      return who + kind + formatted(" (NMT state %02X)", fault.code);
    default:
      return who + kind;
  }
}

}  // namespace tendril::hal
