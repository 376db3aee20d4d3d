#include "hal/cia402/simulated_cia402_drive.h"

#include <algorithm>
#include <cmath>

#include "hal/canopen/emergency.h"
#include "hal/cia402/simulated_pdos.h"

namespace tendril::hal {
namespace {

using Slot = SimulatedObjectDictionary::Slot;

constexpr int64_t kMillisecond_ns = 1'000'000, kSecond_ns = 1000 * kMillisecond_ns;
constexpr int64_t kLongAgo_ns = INT64_MIN / 2;
constexpr int64_t kInhibitUnit_ns = 100'000;  // of 1800:3
constexpr uint16_t kMasterLost = 0x8130, kPdoTooShort = 0x8210, kCommunication = 0x8100, kStrayed = 0x8611;

// Homing methods, object 6098.
constexpr int kToNegativeSwitch = 17, kToPositiveSwitch = 18;

/// Error register (1001) bits for an EMCY code: generic, and communication or the profile's own.
constexpr uint8_t error_register(uint16_t emergency) noexcept {
  if (emergency == 0) return 0;
  const int group = emergency >> 12;
  const bool is_communication = emergency >> 8 == 0x81 || emergency >> 8 == 0x82;
  return static_cast<uint8_t>(is_communication ? 0x11
                                               : 0x01 | (group == 2 ? 0x02 : 0) | (group == 3 ? 0x04 : 0) |
                                                     (group == 4 ? 0x08 : 0));
}

/// Whether a mode or homing method is one that this drive has; values of other entries all are.
bool is_spoken(Slot slot, int8_t value) noexcept {
  if (slot == SimulatedObjectDictionary::kMode)
    return value == 0 || value == kModeHoming || value == kModeCyclicPosition || value == kModeCyclicTorque;
  if (slot != SimulatedObjectDictionary::kHomingMethod) return true;
  return value == 0 || value == kToNegativeSwitch || value == kToPositiveSwitch || homes_in_place(value);
}

}  // namespace

SimulatedCia402Drive::SimulatedCia402Drive(const SimulatedCia402Spec& spec) noexcept
    : node_(spec.node),
      error_window_(spec.error_window),
      rated_torque_mNm_(spec.rated_torque_mNm),
      torque_limit_(spec.torque_limit),
      objects_(spec.node, spec.pdo, spec.rpdo_id, spec.tpdo_id, spec.rpdo_target),
      zero_(spec.incremental ? spec.position_counts : 0),
      servo_(spec.top_speed, spec.tuning, spec.position_counts),
      referenced_(!spec.incremental),
      referenced_mask_(static_cast<uint16_t>(spec.referenced_bit < 0 ? 0 : 1u << spec.referenced_bit)) {
  restore_settings();
}

/// What the drive was set up for before power-on.
void SimulatedCia402Drive::restore_settings() noexcept {
  objects_.set(SimulatedObjectDictionary::kErrorWindow, error_window_);
  objects_.set(SimulatedObjectDictionary::kRatedTorque, rated_torque_mNm_);
}

void SimulatedCia402Drive::receive(const Frame& frame, int64_t now_ns, FrameBatch& out) noexcept {
  advance(now_ns, out);
  if (frame.remote) return;  // nothing of it is sent on request: no node guarding, no polled PDO
  if (const auto request = decode_nmt(frame)) {
    if (request->node == 0 || request->node == node_) obey_nmt(request->command);
    return;
  }
  if (const auto request = decode_sdo_request(frame, node_)) {
    if (nmt_ != NmtState::kStopped) serve_sdo(*request, out);
    return;
  }
  const uint32_t consumer = objects_[SimulatedObjectDictionary::kConsumer];
  if (consumer & 0xFFFF && decode_heartbeat(frame, static_cast<int>(consumer >> 16))) {
    master_seen_ns_ = now_ns_;
    return;
  }
  if (nmt_ != NmtState::kOperational || frame.extended) return;
  if (frame.id == kSyncId) on_sync(out);
  // Bit 30 means nothing in 1400:1. [CiA 301]
  if (is_on(objects_, SimulatedObjectDictionary::kRpdo) &&
      frame.id == (objects_[SimulatedObjectDictionary::kRpdoId] & 0x7FF))
    on_rpdo(frame, out);
}

void SimulatedCia402Drive::advance(int64_t now_ns, FrameBatch& out) noexcept {
  if (!started_) now_ns_ = now_ns;
  started_ = true;
  home(now_ns);
  move(now_ns);
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
  watch_master(now_ns, out);
  tell_changes(out);
  const int64_t period_ns = objects_[SimulatedObjectDictionary::kProducer] * kMillisecond_ns;
  if (period_ns > 0 && now_ns >= next_heartbeat_ns_) {
    out.push(encode_heartbeat(node_, nmt_));
    next_heartbeat_ns_ = now_ns + period_ns;
  }
}

void SimulatedCia402Drive::obey_nmt(NmtCommand command) noexcept {
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
      rpdo_too_short_ = false;
      update_error_register();
      nmt_ = NmtState::kBootUp;
      master_seen_ns_ = -1;
      break;
  }
  if (nmt_ == NmtState::kStopped || nmt_ == NmtState::kBootUp) upload_left_ = {};
  if (nmt_ == before) return;
  has_pending_rpdo_ = false;
  syncs_since_tpdo_ = 0;
  last_tpdo_ = {};  // so that the first one after the start goes as a change
  tpdo_ns_ = kLongAgo_ns;
  // No setpoints come outside NMT operational: a drive that was following them must stop, as with the
  // connection lost [CiA 402-2, abort connection option 6007 = 1].
  if (nmt_ != NmtState::kOperational && state_ == DriveState::kEnabled) injected_fault_ = kCommunication;
}

/// As at power-on, but for where it stands and what it knows of that.
void SimulatedCia402Drive::reset() noexcept {
  objects_.restore_all();
  restore_settings();
  state_ = DriveState::kNotReady;
  controlword_ = 0;
  homing_ = Homing::kNone;
  limited_ = strayed_ = false;
}

void SimulatedCia402Drive::serve_sdo(const SdoRequest& request, FrameBatch& out) noexcept {
  if (request.kind != SdoRequest::Kind::kReadSegment) upload_left_ = {};
  switch (request.kind) {
    case SdoRequest::Kind::kWrite:
      out.push(encode_sdo_answer(node_, write(request, out)));
      break;
    case SdoRequest::Kind::kRead:
      out.push(encode_sdo_answer(node_, read(request.object)));
      break;
    case SdoRequest::Kind::kReadSegment:
      out.push(encode_sdo_answer(node_, next_segment(request.toggle)));
      break;
    case SdoRequest::Kind::kAbort:
      break;
    case SdoRequest::Kind::kOther:
      out.push(encode_sdo_answer(
          node_, {SdoAnswer::Kind::kAbort, request.object, 0, code(SdoAbort::kUnknownCommand)}));
      break;
  }
}

SdoAnswer SimulatedCia402Drive::read(ObjectAddress object) noexcept {
  if (const std::string_view text = SimulatedObjectDictionary::text(object); !text.empty()) {
    upload_ = object;
    upload_left_ = text;
    upload_toggle_ = false;
    return {.kind = SdoAnswer::Kind::kSegmented,
            .object = object,
            .size = 0,
            .value = static_cast<uint32_t>(text.size())};
  }
  measure();
  return objects_.read(object);
}

SdoAnswer SimulatedCia402Drive::next_segment(bool toggle) noexcept {
  const bool running = !upload_left_.empty(), in_turn = toggle == upload_toggle_;
  if (!running || !in_turn) {
    upload_left_ = {};
    return {.kind = SdoAnswer::Kind::kAbort,
            .object = upload_,
            .size = 0,
            .value = code(running ? SdoAbort::kToggle : SdoAbort::kUnknownCommand)};
  }
  SdoAnswer answer{.kind = SdoAnswer::Kind::kSegment, .object = {}, .size = 0, .value = 0, .toggle = toggle};
  answer.size = static_cast<int>(std::min(upload_left_.size(), answer.segment.size()));
  std::copy_n(upload_left_.begin(), answer.size, answer.segment.begin());
  upload_left_.remove_prefix(static_cast<size_t>(answer.size));
  answer.last = upload_left_.empty();
  upload_toggle_ = !upload_toggle_;
  return answer;
}

SdoAnswer SimulatedCia402Drive::write(const SdoRequest& request, FrameBatch& out) noexcept {
  auto [slot, value, abort] = objects_.check_write(request);
  const bool is_pdo = abort == 0 && is_pdo_setting(slot);
  if (is_pdo && nmt_ != NmtState::kPreOperational) abort = code(SdoAbort::kDeviceState);
  if (is_pdo && abort == 0) abort = refuse_pdo_setting(objects_, slot, value);
  if (abort == 0) abort = refuse_value(slot, value);
  if (abort != 0) return {SdoAnswer::Kind::kAbort, request.object, 0, abort};
  set(slot, value);
  if (slot == SimulatedObjectDictionary::kProducer) next_heartbeat_ns_ = now_ns_;
  if (slot == SimulatedObjectDictionary::kConsumer) master_seen_ns_ = -1;
  if (slot == SimulatedObjectDictionary::kControlword) apply_controlword(static_cast<uint16_t>(value), out);
  return {SdoAnswer::Kind::kWritten, request.object, 0, 0};
}

uint32_t SimulatedCia402Drive::refuse_value(Slot slot, uint32_t value) noexcept {
  const uint32_t abort = SimulatedObjectDictionary::check_range(slot, value);
  return abort == 0 && !is_spoken(slot, static_cast<int8_t>(value)) ? code(SdoAbort::kBadValue) : abort;
}

void SimulatedCia402Drive::set(Slot slot, uint32_t value) noexcept {
  objects_.set(slot, value);
  if (slot == SimulatedObjectDictionary::kMode) objects_.set(SimulatedObjectDictionary::kModeDisplay, value);
  if (slot == SimulatedObjectDictionary::kErrorCount)
    for (int i = SimulatedObjectDictionary::kErrorHistory; i <= SimulatedObjectDictionary::kErrorHistoryLast;
         ++i)
      objects_.set(static_cast<Slot>(i), 0);
}

/// One that is too short is not processed, and reported once; no reason to stop. [CiA 301, 0x8210]
void SimulatedCia402Drive::on_rpdo(const Frame& frame, FrameBatch& out) noexcept {
  const bool too_short = frame.length < pdo_length(objects_, SimulatedObjectDictionary::kRpdo);
  if (too_short != rpdo_too_short_) {
    rpdo_too_short_ = too_short;
    report(too_short ? kPdoTooShort : 0, out);
  }
  if (too_short) return;
  pending_rpdo_ = frame;
  has_pending_rpdo_ = true;
  if (objects_[SimulatedObjectDictionary::kRpdoType] > kSynchronousTypes) {
    apply_rpdo(out);
    latch_target();
  }
}

void SimulatedCia402Drive::on_sync(FrameBatch& out) noexcept {
  strayed_ = strays();
  if (strayed_) fail(kStrayed, out);
  apply_rpdo(out);
  latch_target();
  const auto type = static_cast<int>(objects_[SimulatedObjectDictionary::kTpdoType]);
  if (type == 0)
    send_tpdo(true, out);
  else if (type <= static_cast<int>(kSynchronousTypes) && ++syncs_since_tpdo_ >= type)
    send_tpdo(false, out);
}

/// A value that may not be is passed over; the controlword comes last, as the others may be what it acts on.
void SimulatedCia402Drive::apply_rpdo(FrameBatch& out) noexcept {
  if (!has_pending_rpdo_) return;
  has_pending_rpdo_ = false;
  uint16_t word = controlword_;
  for (const auto [slot, value] : unpack_rpdo(objects_, pending_rpdo_)) {
    if (slot == SimulatedObjectDictionary::kControlword) word = static_cast<uint16_t>(value);
    if (slot != SimulatedObjectDictionary::kControlword && refuse_value(slot, value) == 0) set(slot, value);
  }
  apply_controlword(word, out);
}

void SimulatedCia402Drive::send_tpdo(bool only_if_changed, FrameBatch& out) noexcept {
  if (!is_on(objects_, SimulatedObjectDictionary::kTpdo)) return;
  measure();
  const Frame frame = pack_tpdo(objects_);
  if (only_if_changed && frame == last_tpdo_) return;
  last_tpdo_ = frame;
  tpdo_ns_ = now_ns_;
  syncs_since_tpdo_ = 0;
  out.push(frame);
}

/// A TPDO that does not wait for SYNC goes when what it tells has changed, but not before its inhibit time is
/// over, and when its event timer has run down.
void SimulatedCia402Drive::tell_changes(FrameBatch& out) noexcept {
  if (nmt_ != NmtState::kOperational || objects_[SimulatedObjectDictionary::kTpdoType] <= kSynchronousTypes)
    return;
  const int64_t age_ns = now_ns_ - tpdo_ns_;
  const int64_t timer_ns = objects_[SimulatedObjectDictionary::kTpdoTimer] * kMillisecond_ns;
  if (age_ns < objects_[SimulatedObjectDictionary::kTpdoInhibit] * kInhibitUnit_ns) return;
  send_tpdo(timer_ns == 0 || age_ns < timer_ns, out);
}

/// Brings the entries that follow the axis up to date.
void SimulatedCia402Drive::measure() noexcept {
  objects_.set(SimulatedObjectDictionary::kStatusword, statusword());
  objects_.set(SimulatedObjectDictionary::kActualPosition, static_cast<uint32_t>(actual_counts()));
  objects_.set(SimulatedObjectDictionary::kActualTorque, static_cast<uint32_t>(actual_torque()));
}

void SimulatedCia402Drive::apply_controlword(uint16_t word, FrameBatch& out) noexcept {
  const DriveState before = state_;
  const bool start_edge = (word & kStartHoming) && !(controlword_ & kStartHoming);
  state_ = transition(state_, word, controlword_);
  controlword_ = word;
  objects_.set(SimulatedObjectDictionary::kControlword, word);
  if (start_edge && homes()) start_homing();
  if (!(word & kStartHoming) && homing_ != Homing::kAttained) homing_ = Homing::kNone;  // interrupted
  if (before == DriveState::kFault && state_ != DriveState::kFault) {
    objects_.set(SimulatedObjectDictionary::kErrorCode, 0);
    report(0, out);
  }
}

void SimulatedCia402Drive::latch_target() noexcept {
  if (pushes()) {
    servo_.unlock();
    servo_.push(objects_.signed_value(SimulatedObjectDictionary::kTargetTorque) / (1e3 * torque_limit_));
  }
  if (!interpolates()) return;
  double target = objects_.signed_value(SimulatedObjectDictionary::kTargetPosition);
  const int32_t min = objects_.signed_value(SimulatedObjectDictionary::kLimitMin);
  const int32_t max = objects_.signed_value(SimulatedObjectDictionary::kLimitMax);
  limited_ = min < max && (target < min || target > max);
  if (limited_) target = std::clamp<double>(target, min, max);
  const InterpolationPeriod period{
      static_cast<uint8_t>(objects_[SimulatedObjectDictionary::kPeriodValue]),
      static_cast<int8_t>(objects_.signed_value(SimulatedObjectDictionary::kPeriodExponent))};
  servo_.unlock();
  servo_.interpolate(zero_ + target, period.nanoseconds());
}

void SimulatedCia402Drive::move(int64_t now_ns) noexcept {
  now_ns_ = now_ns;
  if (!interpolates() && !pushes() && !searches()) servo_.lock();
  servo_.advance(now_ns);
}

/// Whether the following error has been beyond its window (6065) for longer than 6066 allows. [CiA 402-2]
bool SimulatedCia402Drive::strays() noexcept {
  const uint32_t window = objects_[SimulatedObjectDictionary::kErrorWindow];
  const bool beyond = interpolates() && window != 0xFFFF'FFFF && std::abs(servo_.following_error()) > window;
  if (!beyond) beyond_since_ns_ = -1;
  if (beyond && beyond_since_ns_ < 0) beyond_since_ns_ = now_ns_;
  return beyond &&
         now_ns_ - beyond_since_ns_ >= objects_[SimulatedObjectDictionary::kErrorTime] * kMillisecond_ns;
}

/// Homing without a method is an error [CiA 402-2, object 6098 = 0].
void SimulatedCia402Drive::start_homing() noexcept {
  const int method = objects_.signed_value(SimulatedObjectDictionary::kHomingMethod);
  homing_speed_ = 0;
  homing_ = method == 0 ? Homing::kError : Homing::kSearching;
  if (homes_in_place(method)) take_reference(position());
}

/// Lets time pass in homing mode: towards the switch until it closes, then slowly back until it opens. Must
/// come before `move`, which sets the clock. Without power and in another mode the search is over.
void SimulatedCia402Drive::home(int64_t now_ns) noexcept {
  if (!homes() && homing_ != Homing::kAttained) homing_ = Homing::kNone;
  if (!searches()) homing_speed_ = 0;
  if (!searches()) return;
  const double outwards =
      objects_.signed_value(SimulatedObjectDictionary::kHomingMethod) == kToNegativeSwitch ? -1 : 1;
  const bool closed = outwards * position() >= 0;
  if (homing_ == Homing::kSearching && closed) homing_ = Homing::kLeavingSwitch;
  if (homing_ == Homing::kLeavingSwitch && !closed) return take_reference(0);
  const double wanted = homing_ == Homing::kSearching
                            ? outwards * objects_[SimulatedObjectDictionary::kSearchSpeed]
                            : -outwards * objects_[SimulatedObjectDictionary::kZeroSpeed];
  const double dt = static_cast<double>(now_ns - now_ns_) * 1e-9;
  const double change = objects_[SimulatedObjectDictionary::kHomingAcceleration] * dt;
  homing_speed_ += std::clamp(wanted - homing_speed_, -change, change);
  servo_.unlock();
  servo_.interpolate(servo_.set_point() + homing_speed_, kSecond_ns);
}

/// @param zero  where the encoder shall read 0, counts from SimulatedCia402Spec's zero
void SimulatedCia402Drive::take_reference(double zero) noexcept {
  zero_ = zero;
  homing_ = Homing::kAttained;
  referenced_ = true;
}

void SimulatedCia402Drive::fail(uint16_t emergency, FrameBatch& out) noexcept {
  if (state_ == DriveState::kFaultReaction || state_ == DriveState::kFault) return;
  state_ = DriveState::kFaultReaction;
  objects_.set(SimulatedObjectDictionary::kErrorCode, emergency);
  report(emergency, out);
}

/// Tells of an error that has come, or with code 0 of one that has gone; nodes that are stopped keep that to
/// themselves. [CiA 301, emergency object]
void SimulatedCia402Drive::report(uint16_t emergency, FrameBatch& out) noexcept {
  update_error_register();
  if (emergency != 0) objects_.remember_error(emergency);
  if (nmt_ == NmtState::kStopped) return;
  const auto bits = static_cast<uint8_t>(objects_[SimulatedObjectDictionary::kErrorRegister]);
  out.push(encode_emergency(node_, {.code = emergency, .error_register = bits}));
}

/// The bits of all errors that there are: of a fault, and of an RPDO.
void SimulatedCia402Drive::update_error_register() noexcept {
  const auto fault = static_cast<uint16_t>(objects_[SimulatedObjectDictionary::kErrorCode]);
  const uint16_t rpdo = rpdo_too_short_ ? kPdoTooShort : 0;
  objects_.set(SimulatedObjectDictionary::kErrorRegister, error_register(fault) | error_register(rpdo));
}

/// Heartbeat consumer. It starts with the first heartbeat and, when they end, also takes the node out of NMT
/// operational [CiA 301, objects 1016 and 1029:1 = 0].
void SimulatedCia402Drive::watch_master(int64_t now_ns, FrameBatch& out) noexcept {
  const int64_t limit_ns = (objects_[SimulatedObjectDictionary::kConsumer] & 0xFFFF) * kMillisecond_ns;
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

bool SimulatedCia402Drive::interpolates() const noexcept {
  return state_ == DriveState::kEnabled && !halted() &&
         objects_.signed_value(SimulatedObjectDictionary::kModeDisplay) == kModeCyclicPosition;
}

bool SimulatedCia402Drive::pushes() const noexcept {
  return state_ == DriveState::kEnabled && !halted() &&
         objects_.signed_value(SimulatedObjectDictionary::kModeDisplay) == kModeCyclicTorque;
}

bool SimulatedCia402Drive::homes() const noexcept {
  return state_ == DriveState::kEnabled &&
         objects_.signed_value(SimulatedObjectDictionary::kModeDisplay) == kModeHoming;
}

bool SimulatedCia402Drive::searches() const noexcept {
  return homes() && !halted() && (homing_ == Homing::kSearching || homing_ == Homing::kLeavingSwitch);
}

uint16_t SimulatedCia402Drive::statusword() const noexcept {
  uint16_t word = encode_statusword(state_) | kVoltageEnabled | kRemote;
  if (interpolates() || pushes()) word |= kFollowsCommand;
  if (interpolates() && limited_) word |= kInternalLimit;
  if (strayed_) word |= kFollowingError;
  if (homes() && !searches()) word |= kTargetReached;
  if (homes() && homing_ == Homing::kAttained) word |= kHomingAttained;
  if (homes() && homing_ == Homing::kError) word |= kHomingError;
  if (referenced_) word |= referenced_mask_;
  return word;
}

int32_t SimulatedCia402Drive::actual_counts() const noexcept {
  return static_cast<int32_t>(
      std::clamp(std::round(position() - zero_), double{INT32_MIN}, double{INT32_MAX}));
}

int16_t SimulatedCia402Drive::actual_torque() const noexcept {
  return static_cast<int16_t>(
      std::clamp(std::round(1e3 * torque_limit_ * servo_.force()), double{INT16_MIN}, double{INT16_MAX}));
}

}  // namespace tendril::hal
