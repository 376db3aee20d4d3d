// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/simulated_cia402_drive.h"

#include "hal/canopen/emergency.h"

namespace tendril::hal {
namespace {

using Entry = SimulatedEntry;

constexpr int64_t kMillisecond_ns = 1'000'000;
constexpr uint16_t kMasterLost = 0x8130, kPdoTooShort = 0x8210, kCommunication = 0x8100,
                   kFollowingErrorCode = 0x8611;

/// Error register (1001) bits for an EMCY code: generic, and communication or the profile's own.
constexpr uint8_t error_register(uint16_t emergency) noexcept {
  if (emergency == 0) return 0;
  const int group = emergency >> 12;
  const bool is_communication = emergency >> 8 == 0x81 || emergency >> 8 == 0x82;
  return static_cast<uint8_t>(is_communication ? 0x11
                                               : 0x01 | (group == 2 ? 0x02 : 0) | (group == 3 ? 0x04 : 0) |
                                                     (group == 4 ? 0x08 : 0));
}

}  // namespace

SimulatedCia402Drive::SimulatedCia402Drive(const SimulatedCia402Spec& spec) noexcept
    : node_(spec.node),
      left_enabled_(spec.left_enabled),
      error_window_(spec.error_window),
      rated_torque_mNm_(spec.rated_torque_mNm),
      objects_(spec.node, spec.pdo, spec.rpdo_id, spec.tpdo_id, spec.rpdo_target),
      motion_(spec) {
  restore_settings();
  objects_.set(Entry::kPositionOffset, static_cast<uint32_t>(spec.position_offset));
  if (!left_enabled_) return;
  state_ = DriveState::kEnabled;
  objects_.write(Entry::kMode, kModeCyclicPosition);
  objects_.set(Entry::kTargetPosition, static_cast<uint32_t>(motion_.actual_counts() - spec.position_offset));
}

/// What the drive was set up for before power-on.
void SimulatedCia402Drive::restore_settings() noexcept {
  objects_.set(Entry::kErrorWindow, error_window_);
  objects_.set(Entry::kRatedTorque, rated_torque_mNm_);
}

void SimulatedCia402Drive::receive(const Frame& frame, int64_t now_ns, FrameBatch& out) noexcept {
  advance(now_ns, out);
  if (frame.remote) return;  // nothing of it is sent on request: no node guarding, no polled PDO
  if (const auto request = decode_nmt(frame)) {
    if (request->node == 0 || request->node == node_) handle_nmt(request->command);
    return;
  }
  if (const auto request = decode_sdo_request(frame, node_)) {
    if (nmt_ != NmtState::kStopped) serve_sdo(*request, out);
    return;
  }
  const uint32_t consumer = objects_[Entry::kConsumer];
  if (consumer & 0xFFFF && decode_heartbeat(frame, static_cast<int>(consumer >> 16))) {
    master_seen_ns_ = now_ns_;
    return;
  }
  if (nmt_ != NmtState::kOperational || frame.extended) return;
  if (frame.id == kSyncId) on_sync(out);
  on_rpdo(frame, out);
}

void SimulatedCia402Drive::advance(int64_t now_ns, FrameBatch& out) noexcept {
  motion_.advance(motion_input(), now_ns);
  now_ns_ = now_ns;
  if (nmt_ == NmtState::kBootUp) {
    out.push(encode_heartbeat(node_, NmtState::kBootUp));
    nmt_ = NmtState::kPreOperational;
  }
  // States that a drive leaves by itself [CiA 402-2, transitions 1 and 14].
  if (state_ == DriveState::kNotReady) state_ = DriveState::kSwitchOnDisabled;
  if (state_ == DriveState::kFaultReaction) state_ = DriveState::kFault;
  if (injected_fault_ != 0) {
    fail(injected_fault_, out);
    injected_fault_ = 0;
  }
  monitor_master(now_ns, out);
  if (nmt_ == NmtState::kOperational) {
    update_actual_values();
    pdos_.advance(objects_, now_ns, out);
  }
  send_heartbeat(now_ns, out);
}

void SimulatedCia402Drive::send_heartbeat(int64_t now_ns, FrameBatch& out) noexcept {
  const int64_t period_ns = objects_[Entry::kProducer] * kMillisecond_ns;
  if (period_ns == 0 || now_ns < next_heartbeat_ns_) return;
  out.push(encode_heartbeat(node_, nmt_));
  next_heartbeat_ns_ = now_ns + period_ns;
}

void SimulatedCia402Drive::handle_nmt(NmtCommand command) noexcept {
  const NmtState before = nmt_;
  switch (command) {
    case NmtCommand::kStart:
      nmt_ = NmtState::kOperational;
      break;
    case NmtCommand::kStop:
      nmt_ = NmtState::kStopped;
      break;
    case NmtCommand::kPreOperational:
      nmt_ = NmtState::kPreOperational;
      break;
    case NmtCommand::kResetNode:
      reset();
      [[fallthrough]];
    case NmtCommand::kResetCommunication:
      objects_.restore_communication();
      pdos_ = {};
      update_error_register();
      nmt_ = NmtState::kBootUp;
      master_seen_ns_ = -1;
      break;
  }
  if (nmt_ == NmtState::kStopped || nmt_ == NmtState::kBootUp) sdo_server_.end_upload();
  if (nmt_ == before) return;
  pdos_.restart();
  // No set-points come outside NMT operational: a drive that was following them must stop, as with the
  // connection lost [CiA 402-2, abort connection option 6007 = 1].
  const bool stops = nmt_ != NmtState::kOperational && state_ == DriveState::kEnabled;
  if (stops && !left_enabled_) injected_fault_ = kCommunication;
}

/// As at power-on, except for its position and its reference.
void SimulatedCia402Drive::reset() noexcept {
  objects_.restore_all();
  restore_settings();
  state_ = DriveState::kNotReady;
  controlword_ = 0;
  motion_.reset();
}

void SimulatedCia402Drive::serve_sdo(const SdoRequest& request, FrameBatch& out) noexcept {
  update_actual_values();
  const auto [answer, written] = sdo_server_.serve(request, nmt_, objects_);
  if (written == Entry::kProducer) next_heartbeat_ns_ = now_ns_;
  if (written == Entry::kConsumer) master_seen_ns_ = -1;
  if (written == Entry::kControlword)
    apply_controlword(static_cast<uint16_t>(objects_[Entry::kControlword]), out);
  if (answer) out.push(encode_sdo_answer(node_, *answer));
}

/// An RPDO that is too short is not processed, and reported once; no reason to stop. [CiA 301, 0x8210]
void SimulatedCia402Drive::on_rpdo(const Frame& frame, FrameBatch& out) noexcept {
  if (pdos_.receive(objects_, frame)) report(pdos_.rpdo_too_short() ? kPdoTooShort : 0, out);
  if (!pdos_.rpdo_due(objects_)) return;
  apply_rpdo(out);
  motion_.take_target(motion_input());
}

void SimulatedCia402Drive::on_sync(FrameBatch& out) noexcept {
  if (motion_.judge_following_error(motion_input())) fail(kFollowingErrorCode, out);
  apply_rpdo(out);
  motion_.take_target(motion_input());
  update_actual_values();
  pdos_.on_sync(objects_, now_ns_, out);
}

/// A value that is not allowed is skipped; the controlword comes last, as the others may be what it acts on.
void SimulatedCia402Drive::apply_rpdo(FrameBatch& out) noexcept {
  const auto values = pdos_.take_rpdo(objects_);
  if (!values) return;
  uint16_t word = controlword_;
  for (const auto [entry, value] : *values) {
    if (entry == Entry::kControlword)
      word = static_cast<uint16_t>(value);
    else if (SimulatedObjectDictionary::check_value(entry, value) == 0)
      objects_.write(entry, value);
  }
  apply_controlword(word, out);
}

void SimulatedCia402Drive::apply_controlword(uint16_t word, FrameBatch& out) noexcept {
  const DriveState before = state_;
  state_ = transition(state_, word, controlword_);
  objects_.set(Entry::kControlword, word);
  motion_.handle_homing_bit(motion_input(), controlword_, word);
  controlword_ = word;
  if (before == DriveState::kFault && state_ != DriveState::kFault) {
    objects_.set(Entry::kErrorCode, 0);
    report(0, out);
  }
}

/// Brings the entries that follow the axis up to date.
void SimulatedCia402Drive::update_actual_values() noexcept {
  const uint16_t statusword =
      encode_statusword(state_) | kVoltageEnabled | kRemote | motion_.status_bits(motion_input());
  objects_.set(Entry::kStatusword, statusword);
  objects_.set(Entry::kActualPosition, static_cast<uint32_t>(motion_.actual_counts()));
  objects_.set(Entry::kActualTorque, static_cast<uint32_t>(motion_.actual_torque()));
}

void SimulatedCia402Drive::fail(uint16_t emergency, FrameBatch& out) noexcept {
  if (state_ == DriveState::kFaultReaction || state_ == DriveState::kFault) return;
  state_ = DriveState::kFaultReaction;
  objects_.set(Entry::kErrorCode, emergency);
  report(emergency, out);
}

/// Sends an EMCY of an error that has appeared, or with code 0 of one that is gone; a node that is stopped
/// sends none. [CiA 301, emergency object]
void SimulatedCia402Drive::report(uint16_t emergency, FrameBatch& out) noexcept {
  update_error_register();
  if (emergency != 0) objects_.remember_error(emergency);
  if (nmt_ == NmtState::kStopped) return;
  const auto bits = static_cast<uint8_t>(objects_[Entry::kErrorRegister]);
  out.push(encode_emergency(node_, {.code = emergency, .error_register = bits}));
}

/// The bits of all errors that there are: of a fault, and of an RPDO.
void SimulatedCia402Drive::update_error_register() noexcept {
  const auto fault = static_cast<uint16_t>(objects_[Entry::kErrorCode]);
  const uint16_t rpdo = pdos_.rpdo_too_short() ? kPdoTooShort : 0;
  objects_.set(Entry::kErrorRegister, error_register(fault) | error_register(rpdo));
}

/// Heartbeat consumer. It starts with the first heartbeat and, when they end, also takes the node out of NMT
/// operational [CiA 301, objects 1016 and 1029:1 = 0].
void SimulatedCia402Drive::monitor_master(int64_t now_ns, FrameBatch& out) noexcept {
  const int64_t limit_ns = (objects_[Entry::kConsumer] & 0xFFFF) * kMillisecond_ns;
  if (limit_ns == 0 || master_seen_ns_ < 0 || now_ns - master_seen_ns_ < limit_ns) return;
  master_seen_ns_ = -1;
  fail(kMasterLost, out);
  if (nmt_ == NmtState::kOperational) nmt_ = NmtState::kPreOperational;
}

PowerStage SimulatedCia402Drive::power_stage() const noexcept {
  switch (state_) {
    case DriveState::kEnabled:
    case DriveState::kQuickStop:
      return PowerStage::kOn;
    case DriveState::kFaultReaction:
    case DriveState::kFault:
      return PowerStage::kFault;
    default:
      return PowerStage::kOff;
  }
}

}  // namespace tendril::hal
