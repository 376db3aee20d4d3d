#include "hal/cia402/cia402_axis.h"

#include <algorithm>
#include <cmath>

namespace tendril::hal {
namespace {

// NMT start is repeated: it is the one order of start-up that no answer confirms at once.
constexpr int64_t kNmtRepeat_ns = 100'000'000;

// How long the fault-reset bit keeps each level: drives sample it in a slow loop.
constexpr int64_t kResetHold_ns = 10'000'000;

// What the statusword says of homing may be of an earlier procedure until the drive has seen the order.
constexpr int64_t kHomingSettle_ns = 100'000'000;

// The error code as the drive keeps it, whatever it is.
const SdoStep kReadErrorCode[] = {
    {{SdoRequest::Kind::kRead, {0x603F, 0}, 0, 0}, 0, 0, false, Tolerance::kNone}};

bool at_rest(DriveState state) noexcept {
  return state == DriveState::kSwitchOnDisabled || state == DriveState::kFault;
}

bool in_fault(DriveState state) noexcept {
  return state == DriveState::kFault || state == DriveState::kFaultReaction;
}

}  // namespace

Cia402Axis::Cia402Axis(const AxisConfig& axis, const MasterConfig& config)
    : config_(config),
      node_(axis.node),
      rpdo_id_(rpdo_cob_id(axis)),
      tpdo_id_(tpdo_cob_id(axis)),
      scale_(axis.scale),
      follows_effort_(axis.set_point == SetPoint::kEffort),
      rated_torque_(cia402_settings(axis).rated_torque),
      range_(axis),
      setup_steps_(setup_steps(axis, config)),
      homing_steps_(homing_steps(axis)),
      following_steps_(following_steps(axis)),
      release_steps_(release_steps()),
      soft_limits_(soft_limits(axis)),
      reference_(cia402_settings(axis).reference),
      referenced_mask_(static_cast<uint16_t>(
          cia402_settings(axis).referenced_bit < 0 ? 0 : 1u << cia402_settings(axis).referenced_bit)),
      homing_timeout_ns_(cia402_settings(axis).homing.timeout_ns),
      sdo_(axis.node, cia402_settings(config).sdo_timeout_ns, cia402_settings(config).sdo_attempts),
      names_(axis.node, cia402_settings(config).sdo_timeout_ns, cia402_settings(config).sdo_attempts) {}

void Cia402Axis::receive(const Frame& frame, int64_t arrival_ns) noexcept {
  if (const auto feedback = decode_drive_feedback(tpdo_id_, frame)) {
    if (synchronous()) on_feedback(*feedback, arrival_ns);
  } else if (const auto state = decode_heartbeat(frame, node_)) {
    on_heartbeat(*state, arrival_ns);
  } else if (const auto emergency = decode_emergency(frame, node_)) {
    on_emergency(*emergency);
  } else if (const auto answer = decode_sdo_answer(frame, node_)) {
    if (stage_ == Stage::kIdentifying)
      names_.receive(*answer);
    else
      sdo_.receive(*answer);
  }
}

void Cia402Axis::on_heartbeat(NmtState state, int64_t arrival_ns) noexcept {
  nmt_ = state;
  heartbeat_ns_ = arrival_ns;
  switch (stage_) {
    case Stage::kBooting:
    case Stage::kIdentifying:
    case Stage::kConfiguring:
    case Stage::kStarting:
      if (state == NmtState::kBootUp) configure();  // whatever it had been told, it has forgotten
      if (stage_ == Stage::kStarting && state == NmtState::kOperational) {
        stage_ = Stage::kRunning;
        stage_since_ns_ = arrival_ns;
      }
      break;
    case Stage::kRunning:
      if (state != NmtState::kOperational) fail(FaultKind::kDriveRestarted, static_cast<uint32_t>(state));
      break;
    default:
      break;
  }
}

void Cia402Axis::on_emergency(const Emergency& emergency) noexcept {
  emergency_ = emergency.code;
  if (emergency.code == 0) return;
  if (fault_.kind == FaultKind::kDriveFault && fault_.code == 0) fault_.code = emergency.code;
  if (stage_ == Stage::kRunning && phase_ != Phase::kOff) fail(FaultKind::kDriveFault, emergency.code);
}

void Cia402Axis::on_feedback(const DriveFeedback& feedback, int64_t arrival_ns) noexcept {
  statusword_ = feedback.statusword;
  state_ = decode_statusword(feedback.statusword);
  position_ = feedback.position;
  position_stamp_ns_ = arrival_ns;
  watch_reference();
  if (!in_fault(state_)) clearing_fault_ = false;
  if (phase_ == Phase::kOff || clearing_fault_) return;
  if (in_fault(state_))
    fail(FaultKind::kDriveFault, emergency_);
  else if (phase_ == Phase::kOn && state_ != DriveState::kEnabled)
    fail(FaultKind::kDriveDisabled, statusword_);
  else if (enabled() && range_.left_at(position()))
    fail(FaultKind::kOutOfRange, static_cast<uint32_t>(range_.beyond(position())));
  else if (phase_ == Phase::kEnabling && state_ == DriveState::kEnabled)
    phase_ = Phase::kOn;
  if (homing_since_ns_ != 0) judge_homing(arrival_ns);
}

/// A reference is there from the start, comes by homing, or is told by a bit of the statusword, which must
/// then stay set.
void Cia402Axis::watch_reference() noexcept {
  const bool absolute = reference_ == Reference::kAbsolute;
  if (referenced_mask_ == 0) {
    referenced_ = referenced_ || absolute;
  } else if (task_ != Task::kHome) {  // while that runs the bit may be either
    const bool told = (statusword_ & referenced_mask_) != 0;
    if (!told && (referenced_ || absolute)) fail(FaultKind::kNotReferenced, statusword_);
    referenced_ = told;
  }
}

void Cia402Axis::judge_homing(int64_t arrival_ns) noexcept {
  if (arrival_ns - homing_since_ns_ < kHomingSettle_ns) return;
  constexpr uint16_t kThere = kHomingAttained | kTargetReached;
  if (statusword_ & kHomingError)
    fail(FaultKind::kHomingFailed, statusword_);
  else if ((statusword_ & kThere) == kThere)
    referenced_ = referenced_mask_ == 0 || (statusword_ & referenced_mask_);
}

void Cia402Axis::supervise(int64_t now_ns, int64_t synced_ns) noexcept {
  if (!synchronous() || fault_.kind != FaultKind::kNone) return;
  if (now_ns - heartbeat_ns_ > config_.heartbeat_timeout_ns) return fail(FaultKind::kHeartbeatLost, 0);
  if (stage_ == Stage::kStarting) {
    if (now_ns - stage_since_ns_ > config_.start_timeout_ns)
      fail(FaultKind::kStartTimeout, static_cast<uint32_t>(nmt_));
    return;
  }
  if (synced_ns - std::max(stage_since_ns_, position_stamp_ns_) > config_.feedback_timeout_ns)
    return fail(FaultKind::kFeedbackLost, 0);
  const bool enabling = awaits_rest_ || phase_ == Phase::kPreparing || phase_ == Phase::kEnabling;
  if (enabling && now_ns - enabling_since_ns_ > config_.enable_timeout_ns) {
    if (in_fault(state_))
      fail(FaultKind::kDriveFault, emergency_);
    else
      fail(FaultKind::kEnableTimeout, statusword_);
  }
  if (homing_since_ns_ != 0 && !referenced_ && now_ns - homing_since_ns_ > homing_timeout_ns_)
    fail(statusword_ & kHomingAttained ? FaultKind::kNotReferenced : FaultKind::kHomingTimeout, statusword_);
}

void Cia402Axis::set_up(int64_t now_ns, FrameBatch& out) noexcept {
  switch (stage_) {
    case Stage::kReset:
      out.push(encode_nmt({NmtCommand::kResetCommunication, node_}));
      stage_ = Stage::kBooting;
      stage_since_ns_ = now_ns;
      may_watch_us_ = false;
      break;
    case Stage::kBooting:
      if (now_ns - stage_since_ns_ > config_.start_timeout_ns) configure();
      break;
    case Stage::kIdentifying:
      switch (names_.advance(now_ns, out)) {
        case SdoUpload::Status::kRunning:
          break;
        case SdoUpload::Status::kDone:
          configure();
          break;
        case SdoUpload::Status::kFailed:
          fail_sdo(FaultKind::kConfiguration, static_cast<uint32_t>(SdoAbort::kTimeout), names_.object(), 0);
          break;
      }
      break;
    case Stage::kConfiguring:
      switch (sdo_.advance(now_ns, out)) {
        case SdoSequence::Status::kRunning:
          break;
        case SdoSequence::Status::kDone:
          stage_ = Stage::kStarting;
          stage_since_ns_ = heartbeat_ns_ = now_ns;
          last_nmt_start_ns_ = now_ns - kNmtRepeat_ns;
          break;
        case SdoSequence::Status::kFailed:
          fail_setup();
          break;
      }
      break;
    case Stage::kRunning:
      if (asks_error_code_) return ask_error_code(now_ns, out);
      if (phase_ == Phase::kPreparing) switch (sdo_.advance(now_ns, out)) {
          case SdoSequence::Status::kRunning:
            break;
          case SdoSequence::Status::kDone:
            phase_ = Phase::kEnabling;
            break;
          case SdoSequence::Status::kFailed:
            fail_setup();
            break;
        }
      break;
    case Stage::kReleasing:
      if (sdo_.advance(now_ns, out) != SdoSequence::Status::kRunning) stage_ = Stage::kFinished;
      break;
    default:
      break;
  }
  if (stage_ == Stage::kStarting && now_ns - last_nmt_start_ns_ >= kNmtRepeat_ns) {
    out.push(encode_nmt({NmtCommand::kStart, node_}));
    last_nmt_start_ns_ = now_ns;
  }
}

void Cia402Axis::ask_error_code(int64_t now_ns, FrameBatch& out) noexcept {
  const SdoSequence::Status status = sdo_.advance(now_ns, out);
  asks_error_code_ = status == SdoSequence::Status::kRunning;
  if (status == SdoSequence::Status::kDone && fault_.code == 0) fault_.code = sdo_.found() & 0xFFFF;
}

void Cia402Axis::drive(Task task, bool may_begin, bool all_enabled, const AxisTarget& target, int64_t now_ns,
                       FrameBatch& out) noexcept {
  if (stage_ != Stage::kRunning || position_stamp_ns_ == 0) return;
  const bool sound = fault_.kind == FaultKind::kNone;
  if (!sound) task = Task::kRest;
  if (task != task_) {
    task_ = task;
    phase_ = Phase::kOff;
    homing_since_ns_ = 0;
  }
  const bool may_enable = task_ != Task::kRest && phase_ == Phase::kOff && may_begin;
  if (may_enable && !awaits_rest_) enabling_since_ns_ = now_ns;
  awaits_rest_ = may_enable && !at_rest(state_);
  if (may_enable && at_rest(state_)) begin(now_ns);
  if (phase_ == Phase::kEnabling)
    controlword_ = enabling_word(now_ns);
  else if (phase_ == Phase::kOn)
    controlword_ = task_ == Task::kHome ? kEnableOperation | kStartHoming : kEnableOperation;
  else
    controlword_ = sound ? next_controlword(state_, DriveState::kSwitchOnDisabled) : kDisableVoltage;
  if ((controlword_ & kStartHoming) && homing_since_ns_ == 0) homing_since_ns_ = now_ns;

  out.push(command_frame(all_enabled, target));
}

/// A torque is there before the power is, so that nothing sags at enabling; a position is not, 607A follows
/// 6064 until then, so that nothing jumps.
Frame Cia402Axis::command_frame(bool all_enabled, const AxisTarget& target) noexcept {
  if (follows_effort_) {
    const double thousandths = std::round(1e3 * scale_.to_torque(target.effort) / rated_torque_);
    if (task_ != Task::kFollow)
      torque_ = 0;
    else if (std::isfinite(thousandths))
      torque_ = static_cast<int16_t>(std::clamp(thousandths, double{-INT16_MAX}, double{INT16_MAX}));
    return encode_torque_command(rpdo_id_, {controlword_, torque_});
  }
  following_ = enabled() && (following_ || all_enabled);
  if (following_ && std::isfinite(target.position)) target_ = scale_.to_counts(target.position);
  if (state_ != DriveState::kEnabled) target_ = position_;
  return encode_drive_command(rpdo_id_, {controlword_, target_});
}

/// The mode is chosen while the drive has no power: where homing has moved the zero, 607A follows 6064 until
/// the drive is enabled again.
void Cia402Axis::begin(int64_t now_ns) noexcept {
  phase_ = Phase::kPreparing;
  enabling_since_ns_ = now_ns;
  clearing_fault_ = state_ == DriveState::kFault;
  range_.begin(position());
  if (soft_limits_) set_soft_limits(following_steps_, widened(*soft_limits_, position_));
  sdo_.start(task_ == Task::kHome ? homing_steps_ : following_steps_);
}

/// The next step to "operation enabled"; out of a fault by a slow square wave on the reset bit.
uint16_t Cia402Axis::enabling_word(int64_t now_ns) noexcept {
  if (!clearing_fault_) return next_controlword(state_, DriveState::kEnabled);
  if (now_ns - reset_edge_ns_ < kResetHold_ns) return controlword_;
  reset_edge_ns_ = now_ns;
  return controlword_ & kFaultReset ? kDisableVoltage : kFaultReset;
}

void Cia402Axis::restart() noexcept {
  stage_ = Stage::kReset;
  task_ = Task::kRest;
  phase_ = Phase::kOff;
  awaits_rest_ = false;
  following_ = referenced_ = false;
  homing_since_ns_ = 0;
  state_ = DriveState::kUnknown;
  position_stamp_ns_ = 0;
  emergency_ = 0;
  asks_error_code_ = false;
  fault_ = {};
}

void Cia402Axis::release(FrameBatch& out) noexcept {
  if (asks_error_code_ || stage_ == Stage::kReleasing || stage_ == Stage::kFinished) return;
  stage_ = Stage::kFinished;
  if (!may_watch_us_) return;
  out.push(encode_nmt({NmtCommand::kPreOperational, node_}));
  sdo_.start(release_steps_);
  stage_ = Stage::kReleasing;
}

bool Cia402Axis::setting_up() const noexcept {
  return stage_ == Stage::kReset || stage_ == Stage::kIdentifying || stage_ == Stage::kConfiguring ||
         stage_ == Stage::kReleasing || phase_ == Phase::kPreparing || asks_error_code_;
}

bool Cia402Axis::needs_homing() const noexcept {
  return stage_ == Stage::kRunning && reference_ == Reference::kHoming && !referenced_;
}

bool Cia402Axis::connected(int64_t synced_ns) const noexcept {
  return stage_ == Stage::kRunning && position_stamp_ns_ != 0 &&
         synced_ns - position_stamp_ns_ <= config_.feedback_timeout_ns;
}

bool Cia402Axis::disabled() const noexcept {
  if (stage_ != Stage::kRunning) return true;
  // A drive we cannot hear has its own watch on us; nobody can wait for its statusword.
  if (fault_.kind == FaultKind::kHeartbeatLost || fault_.kind == FaultKind::kFeedbackLost ||
      fault_.kind == FaultKind::kDriveRestarted)
    return true;
  return state_ == DriveState::kSwitchOnDisabled || state_ == DriveState::kFault ||
         state_ == DriveState::kNotReady || state_ == DriveState::kUnknown;
}

double Cia402Axis::position() const noexcept { return scale_.to_displacement(position_); }

void Cia402Axis::configure() noexcept {
  if (names_.known()) {
    stage_ = Stage::kConfiguring;
    may_watch_us_ = true;
    sdo_.start(setup_steps_);
  } else {
    stage_ = Stage::kIdentifying;
    names_.start();
  }
}

void Cia402Axis::fail(FaultKind kind, uint32_t code) noexcept {
  if (fault_.kind != FaultKind::kNone) return;
  fault_ = {.kind = kind, .code = code};
  phase_ = Phase::kOff;
  homing_since_ns_ = 0;
  if (kind == FaultKind::kStartTimeout) stage_ = Stage::kFailed;
  asks_error_code_ = kind == FaultKind::kDriveFault && code == 0;
  if (asks_error_code_) sdo_.start(kReadErrorCode);
}

void Cia402Axis::fail_setup() noexcept {
  const SdoStep& step = sdo_.step();
  if (sdo_.failure() != 0)
    fail_sdo(FaultKind::kConfiguration, sdo_.failure(), step.request.object, 0);
  else
    fail_sdo(FaultKind::kUnexpectedValue, sdo_.found(), step.request.object, step.expected);
}

void Cia402Axis::fail_sdo(FaultKind kind, uint32_t code, ObjectAddress object, uint32_t expected) noexcept {
  if (fault_.kind != FaultKind::kNone) return;
  fail(kind, code);
  fault_.object = static_cast<uint32_t>(object.index) << 8 | object.sub;
  fault_.expected = expected;
  stage_ = Stage::kFailed;
}

}  // namespace tendril::hal
