// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/cia402_power_control.h"

#include <algorithm>
#include <cmath>

#include "hal/cia402/cia402_startup.h"

namespace tendril::hal {
namespace {

// How long the fault-reset bit keeps each level: drives sample it in a slow loop.
constexpr int64_t kResetHold_ns = 10'000'000;

// The homing bits of the statusword may be those of an earlier procedure until the drive has seen the
// command.
constexpr int64_t kHomingSettle_ns = 100'000'000;

// How long a drive may say that it does not follow: at enabling the bit comes late.
constexpr int64_t kNotFollowing_ns = 100'000'000;

/// Whether a drive can begin to be enabled.
bool can_begin(DriveState state) noexcept {
  return state == DriveState::kSwitchOnDisabled || state == DriveState::kFault;
}

bool in_fault(DriveState state) noexcept {
  return state == DriveState::kFault || state == DriveState::kFaultReaction;
}

}  // namespace

Cia402PowerControl::Cia402PowerControl(const AxisConfig& axis, const MasterConfig& config)
    : config_(config),
      rpdo_id_(rpdo_cob_id(axis)),
      scale_(axis.scale),
      follows_effort_(axis.set_point == SetPoint::kEffort),
      rated_torque_(cia402_settings(axis).rated_torque),
      range_(axis),
      following_monitor_(axis, config.period_ns),
      homing_steps_(homing_steps(axis, config)),
      following_steps_(following_steps(axis, config)),
      homing_mode_(mode_steps(kModeHoming)),
      following_mode_(mode_steps(following_mode(axis))),
      soft_limits_(soft_limits(axis)),
      reference_(cia402_settings(axis).reference),
      referenced_mask_(static_cast<uint16_t>(
          cia402_settings(axis).referenced_bit < 0 ? 0 : 1u << cia402_settings(axis).referenced_bit)),
      homing_timeout_ns_(cia402_settings(axis).homing.timeout_ns) {}

DriveFault Cia402PowerControl::on_feedback(const DriveFeedback& feedback, int64_t arrival_ns) noexcept {
  statusword_ = feedback.statusword;
  state_ = decode_statusword(feedback.statusword);
  position_ = feedback.position;
  position_stamp_ns_ = arrival_ns;
  target_counts_ = target_counts_ && state_ == DriveState::kEnabled;
  if (phase_ == Phase::kOff && power_is_off()) may_be_on_ = false;
  const DriveFault reference_fault = monitor_reference();
  if (!in_fault(state_)) clearing_fault_ = false;
  const bool lost_reference = reference_fault.kind != FaultKind::kNone;
  if (lost_reference || phase_ == Phase::kOff || clearing_fault_) return reference_fault;
  const DriveFault power_fault = monitor_power();
  return power_fault.kind != FaultKind::kNone || homing_since_ns_ == 0 ? power_fault
                                                                       : judge_homing(arrival_ns);
}

/// Judges the state of a drive that is being enabled or is on.
DriveFault Cia402PowerControl::monitor_power() noexcept {
  if (in_fault(state_)) return {.kind = FaultKind::kDriveFault, .code = emergency_};
  if ((phase_ == Phase::kOn || phase_ == Phase::kConfirming) && state_ != DriveState::kEnabled)
    return {.kind = FaultKind::kDriveDisabled, .code = statusword_};
  if (enabled()) return monitor_motion();
  if (phase_ != Phase::kEnabling || state_ != DriveState::kEnabled) return {};
  phase_ = Phase::kConfirming;
  asks_mode_ = false;
  target_counts_ = true;
  return {};
}

void Cia402PowerControl::begin_following() noexcept {
  phase_ = Phase::kOn;
  has_followed_ = false;
  not_following_since_ns_ = 0;
  following_monitor_.begin(displacement(), position_stamp_ns_);
}

DriveFault Cia402PowerControl::monitor_motion() noexcept {
  if (range_.is_outside(displacement()))
    return {.kind = FaultKind::kOutOfRange, .code = static_cast<uint32_t>(range_.excess(displacement()))};
  const DriveFault fault = following_monitor_.judge(displacement(), position_stamp_ns_);
  if (fault.kind != FaultKind::kNone) return fault;
  if (says_it_follows())
    not_following_since_ns_ = 0;
  else if (not_following_since_ns_ == 0)
    not_following_since_ns_ = position_stamp_ns_;
  else if (position_stamp_ns_ - not_following_since_ns_ > kNotFollowing_ns)
    return following_monitor_.not_following(displacement(), statusword_);
  return {};
}

/// A drive that never sets bit 12 may not have it; with bit 11 beside it the bit is believed.
bool Cia402PowerControl::says_it_follows() noexcept {
  if (follows_effort_) return true;
  const bool follows = (statusword_ & kFollowsCommand) != 0;
  has_followed_ = has_followed_ || follows;
  if (statusword_ & kFollowingError) return false;
  return follows || !(has_followed_ || (statusword_ & kInternalLimit));
}

/// A reference is there from the start, comes by homing, or is shown by a bit of the statusword, which must
/// then stay set.
DriveFault Cia402PowerControl::monitor_reference() noexcept {
  const bool absolute = reference_ == Reference::kAbsolute;
  if (referenced_mask_ == 0) {
    referenced_ = referenced_ || absolute;
    return {};
  }
  if (task_ == Task::kHome) return {};  // while that runs the bit may be either
  const bool was_referenced = referenced_ || absolute;
  referenced_ = (statusword_ & referenced_mask_) != 0;
  if (referenced_ || !was_referenced) return {};
  return {.kind = FaultKind::kNotReferenced, .code = statusword_};
}

DriveFault Cia402PowerControl::judge_homing(int64_t arrival_ns) noexcept {
  if (arrival_ns - homing_since_ns_ < kHomingSettle_ns) return {};
  if (statusword_ & kHomingError) return {.kind = FaultKind::kHomingFailed, .code = statusword_};
  constexpr uint16_t kDone = kHomingAttained | kTargetReached;
  if ((statusword_ & kDone) == kDone) referenced_ = referenced_mask_ == 0 || (statusword_ & referenced_mask_);
  return {};
}

DriveFault Cia402PowerControl::on_emergency(uint16_t code) noexcept {
  emergency_ = code;
  if (code == 0 || phase_ == Phase::kOff || clearing_fault_)
    return {};  // of a second fault that is cleared, too
  return {.kind = FaultKind::kDriveFault, .code = code};
}

DriveFault Cia402PowerControl::supervise(int64_t now_ns, int64_t running_since_ns,
                                         int64_t last_sync_ns) const noexcept {
  if (last_sync_ns - std::max(running_since_ns, position_stamp_ns_) > config_.feedback_timeout_ns)
    return {.kind = FaultKind::kFeedbackLost};
  const bool enabling = awaits_start_state_ || phase_ == Phase::kPreparing || phase_ == Phase::kEnabling;
  if (enabling && now_ns - enabling_since_ns_ > config_.enable_timeout_ns) {
    if (in_fault(state_)) return {.kind = FaultKind::kDriveFault, .code = emergency_};
    return {.kind = FaultKind::kEnableTimeout, .code = statusword_};
  }
  if (homing_since_ns_ == 0 || referenced_ || now_ns - homing_since_ns_ <= homing_timeout_ns_) return {};
  const bool attained = statusword_ & kHomingAttained;  // but without the bit of the reference
  return {.kind = attained ? FaultKind::kNotReferenced : FaultKind::kHomingTimeout, .code = statusword_};
}

DriveFault Cia402PowerControl::transfer(int64_t now_ns, SdoSequence& sdo, FrameBatch& out) noexcept {
  if (phase_ == Phase::kConfirming && !asks_mode_) {
    asks_mode_ = true;
    sdo.start(task_ == Task::kHome ? homing_mode_ : following_mode_);
  }
  const SdoSequence::Status status = sdo.advance(now_ns, out);
  if (phase_ == Phase::kConfirming) return confirm_mode(status, now_ns, sdo);
  if (status == SdoSequence::Status::kFailed) return fault_of_failed(sdo);
  if (status == SdoSequence::Status::kDone) phase_ = Phase::kEnabling;
  return {};
}

/// A mode that is not shown yet is asked for again.
DriveFault Cia402PowerControl::confirm_mode(SdoSequence::Status status, int64_t now_ns,
                                            SdoSequence& sdo) noexcept {
  if (status == SdoSequence::Status::kDone) begin_following();
  if (status != SdoSequence::Status::kFailed) return {};
  asks_mode_ = false;
  const bool shows_another = sdo.failure() == 0;
  if (shows_another && now_ns - enabling_since_ns_ <= config_.enable_timeout_ns) return {};
  return fault_of_failed(sdo);
}

Frame Cia402PowerControl::command(Task task, bool faulty, bool may_begin, bool all_enabled,
                                  const AxisTarget& target, int64_t now_ns, SdoSequence& sdo) noexcept {
  if (faulty) task = Task::kDisable;
  if (task != task_) {
    task_ = task;
    stop();
  }
  const bool may_enable = task_ != Task::kDisable && phase_ == Phase::kOff && may_begin;
  if (may_enable && !awaits_start_state_) enabling_since_ns_ = now_ns;
  awaits_start_state_ = may_enable && !can_begin(state_);
  if (may_enable && can_begin(state_)) begin_enabling(now_ns, sdo);
  controlword_ = next_word(faulty, now_ns);
  if (phase_ == Phase::kEnabling) may_be_on_ = true;
  if ((controlword_ & kStartHoming) && homing_since_ns_ == 0) homing_since_ns_ = now_ns;
  return rpdo(all_enabled, target);
}

uint16_t Cia402PowerControl::next_word(bool faulty, int64_t now_ns) noexcept {
  if (phase_ == Phase::kEnabling) return enabling_word(now_ns);
  if (phase_ == Phase::kConfirming) return kEnableOperation;
  if (phase_ == Phase::kOn) return task_ == Task::kHome ? kEnableOperation | kStartHoming : kEnableOperation;
  return faulty ? kDisableVoltage : next_controlword(state_, DriveState::kSwitchOnDisabled);
}

/// A torque is in the RPDO before the power is on, so that the load moves nothing at enabling; a position is
/// not, 607A follows 6064 until then, so that nothing jumps. It also does while a drive has power from
/// elsewhere.
Frame Cia402PowerControl::rpdo(bool all_enabled, const AxisTarget& target) noexcept {
  if (follows_effort_) {
    const double thousandths = std::round(1e3 * scale_.to_torque(target.effort) / rated_torque_);
    if (task_ != Task::kFollow)
      torque_ = 0;
    else if (std::isfinite(thousandths))
      torque_ = static_cast<int16_t>(std::clamp(thousandths, double{-INT16_MAX}, double{INT16_MAX}));
    return encode_torque_command(rpdo_id_, {controlword_, torque_});
  }
  following_ = enabled() && (following_ || all_enabled);
  if (following_ && std::isfinite(target.displacement)) target_ = scale_.to_counts(target.displacement);
  if (!target_counts_) target_ = position_;
  following_monitor_.command(scale_.to_displacement(target_));
  return encode_drive_command(rpdo_id_, {controlword_, target_});
}

/// The mode is chosen while the drive has no power: where homing has moved the zero, 607A follows 6064 until
/// the drive is enabled again.
void Cia402PowerControl::begin_enabling(int64_t now_ns, SdoSequence& sdo) noexcept {
  phase_ = Phase::kPreparing;
  enabling_since_ns_ = now_ns;
  clearing_fault_ = state_ == DriveState::kFault;
  range_.begin(displacement());
  if (soft_limits_) set_soft_limits(following_steps_, widened(*soft_limits_, position_));
  sdo.start(task_ == Task::kHome ? homing_steps_ : following_steps_);
}

/// The next step to "operation enabled"; out of a fault by a slow square wave on the reset bit.
uint16_t Cia402PowerControl::enabling_word(int64_t now_ns) noexcept {
  if (!clearing_fault_) return next_controlword(state_, DriveState::kEnabled);
  if (now_ns - reset_edge_ns_ < kResetHold_ns) return controlword_;
  reset_edge_ns_ = now_ns;
  return controlword_ & kFaultReset ? kDisableVoltage : kFaultReset;
}

void Cia402PowerControl::stop() noexcept {
  phase_ = Phase::kOff;
  homing_since_ns_ = 0;
}

void Cia402PowerControl::restart() noexcept {
  stop();
  task_ = Task::kDisable;
  awaits_start_state_ = false;
  following_ = referenced_ = target_counts_ = false;
  state_ = DriveState::kUnknown;
  position_stamp_ns_ = 0;
  emergency_ = 0;
}

bool Cia402PowerControl::power_is_off() const noexcept {
  return state_ == DriveState::kSwitchOnDisabled || state_ == DriveState::kFault ||
         state_ == DriveState::kNotReady;
}

}  // namespace tendril::hal
