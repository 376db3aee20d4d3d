// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/cia402_startup.h"

#include <algorithm>

#include "hal/cia402/cia402_settings.h"
#include "hal/cia402/cia402_setup.h"

namespace tendril::hal {
namespace {

// NMT start is repeated: it is the one command of start-up that no answer confirms at once.
constexpr int64_t kNmtRepeat_ns = 100'000'000;

// A drive that changes its NMT state may miss what comes with the command.
constexpr int64_t kNmtPause_ns = 20'000'000;

// A drive that sends no boot-up message is asked all the same after this time.
constexpr int64_t kBootUpWait_ns = 1'000'000'000;

// Any answer will do.
const SdoStep kAskDeviceType[] = {{.request = {SdoRequest::Kind::kRead, {0x1000, 0}, 0, 0},
                                   .mask = 0,
                                   .tolerance = Tolerance::kUnreadable}};

DriveFault sdo_fault(FaultKind kind, uint32_t code, ObjectAddress object, uint32_t expected) noexcept {
  return {.kind = kind,
          .code = code,
          .object = static_cast<uint32_t>(object.index) << 8 | object.sub,
          .expected = expected};
}

}  // namespace

DriveFault fault_of_failed(const SdoSequence& sdo) noexcept {
  const SdoStep& step = sdo.step();
  if (sdo.failure() != 0) return sdo_fault(FaultKind::kConfiguration, sdo.failure(), step.request.object, 0);
  return sdo_fault(FaultKind::kUnexpectedValue, sdo.found(), step.request.object, sdo.expected());
}

Cia402Startup::Cia402Startup(const AxisConfig& axis, const MasterConfig& config)
    : config_(config),
      node_(axis.node),
      setup_steps_(setup_steps(axis, config)),
      power_off_steps_(power_off_steps()),
      release_steps_(release_steps()),
      names_(axis.node, cia402_settings(config).sdo_timeout_ns, cia402_settings(config).sdo_attempts) {}

DriveFault Cia402Startup::on_heartbeat(NmtState state, int64_t arrival_ns, SdoSequence& sdo) noexcept {
  nmt_ = state;
  heartbeat_ns_ = arrival_ns;
  switch (stage_) {
    case Stage::kBooting:
    case Stage::kAsking:
    case Stage::kIdentifying:
    case Stage::kConfiguring:
    case Stage::kStarting:
      if (state == NmtState::kBootUp) begin_set_up(sdo);  // a reboot clears what had been set up
      if (stage_ == Stage::kStarting && state == NmtState::kOperational) {
        stage_ = Stage::kRunning;
        stage_since_ns_ = arrival_ns;
      }
      return {};
    case Stage::kRunning:
      if (state == NmtState::kOperational) return {};
      return {.kind = FaultKind::kDriveRestarted, .code = static_cast<uint32_t>(state)};
    default:
      return {};
  }
}

void Cia402Startup::on_sdo_answer(const SdoAnswer& answer, SdoSequence& sdo) noexcept {
  if (stage_ == Stage::kIdentifying)
    names_.receive(answer);
  else
    sdo.receive(answer);
}

DriveFault Cia402Startup::supervise(int64_t now_ns) const noexcept {
  if (now_ns - heartbeat_ns_ > config_.heartbeat_timeout_ns) return {.kind = FaultKind::kHeartbeatLost};
  if (stage_ == Stage::kStarting && now_ns - stage_since_ns_ > config_.start_timeout_ns)
    return {.kind = FaultKind::kStartTimeout, .code = static_cast<uint32_t>(nmt_)};
  return {};
}

DriveFault Cia402Startup::advance(int64_t now_ns, SdoSequence& sdo, FrameBatch& out) noexcept {
  DriveFault fault;
  switch (stage_) {
    case Stage::kReset:
      out.push(encode_nmt({NmtCommand::kResetCommunication, node_}));
      stage_ = Stage::kBooting;
      stage_since_ns_ = reset_ns_ = now_ns;
      may_monitor_master_ = false;
      break;
    case Stage::kBooting:
      if (now_ns - stage_since_ns_ > std::min(kBootUpWait_ns, config_.start_timeout_ns)) begin_set_up(sdo);
      break;
    case Stage::kAsking:
      fault = ask(now_ns, sdo, out);
      break;
    case Stage::kIdentifying:
      if (names_.advance(now_ns, out)) begin_configuring(sdo);
      break;
    case Stage::kConfiguring:
      fault = configure(now_ns, sdo, out);
      break;
    case Stage::kCheckingPower:
      check_power(now_ns, sdo, out);
      break;
    case Stage::kReleasing:
      if (sdo.advance(now_ns, out) != SdoSequence::Status::kRunning) stage_ = Stage::kFinished;
      break;
    default:
      break;
  }
  if (stage_ == Stage::kStarting) start_nmt(now_ns, out);
  return fault;
}

/// Takes a drive that starts by itself to NMT pre-operational, where PDOs can be set up, and asks it for its
/// device type, which every drive has. One that does not answer yet may still boot.
DriveFault Cia402Startup::ask(int64_t now_ns, SdoSequence& sdo, FrameBatch& out) noexcept {
  if (enters_preoperational_) {
    out.push(encode_nmt({NmtCommand::kPreOperational, node_}));
    enters_preoperational_ = false;
    stage_since_ns_ = now_ns;
  }
  if (now_ns - stage_since_ns_ < kNmtPause_ns) return {};
  const SdoSequence::Status status = sdo.advance(now_ns, out);
  if (status == SdoSequence::Status::kRunning) return {};
  if (status == SdoSequence::Status::kDone) {
    if (names_.known()) {
      begin_configuring(sdo);
    } else {
      names_.start();
      stage_ = Stage::kIdentifying;
    }
    return {};
  }
  stage_ = Stage::kBooting;
  stage_since_ns_ = now_ns;
  return now_ns - reset_ns_ < config_.start_timeout_ns ? DriveFault{} : fault_of_failed(sdo);
}

DriveFault Cia402Startup::configure(int64_t now_ns, SdoSequence& sdo, FrameBatch& out) noexcept {
  switch (sdo.advance(now_ns, out)) {
    case SdoSequence::Status::kRunning:
      break;
    case SdoSequence::Status::kDone:
      power_is_off_ = true;
      stage_ = Stage::kStarting;
      stage_since_ns_ = heartbeat_ns_ = now_ns;
      last_nmt_start_ns_ = now_ns - kNmtRepeat_ns;
      break;
    case SdoSequence::Status::kFailed:
      return fault_of_failed(sdo);
  }
  return {};
}

void Cia402Startup::begin_set_up(SdoSequence& sdo) noexcept {
  stage_ = Stage::kAsking;
  enters_preoperational_ = true;
  sdo.start(kAskDeviceType);
}

void Cia402Startup::begin_configuring(SdoSequence& sdo) noexcept {
  stage_ = Stage::kConfiguring;
  may_monitor_master_ = true;
  sdo.start(setup_steps_);
}

void Cia402Startup::start_nmt(int64_t now_ns, FrameBatch& out) noexcept {
  if (now_ns - last_nmt_start_ns_ < kNmtRepeat_ns) return;
  out.push(encode_nmt({NmtCommand::kStart, node_}));
  last_nmt_start_ns_ = now_ns;
}

void Cia402Startup::release(bool ours, bool may_be_on, SdoSequence& sdo) noexcept {
  if (stage_ == Stage::kCheckingPower || stage_ == Stage::kReleasing || stage_ == Stage::kFinished) return;
  stage_ = Stage::kFinished;
  if (!may_monitor_master_ && !may_be_on) return;
  ours_ = ours;
  power_is_off_ = false;
  sdo.start(power_off_steps_);
  stage_ = Stage::kCheckingPower;
}

void Cia402Startup::check_power(int64_t now_ns, SdoSequence& sdo, FrameBatch& out) noexcept {
  const SdoSequence::Status status = sdo.advance(now_ns, out);
  if (status == SdoSequence::Status::kRunning) return;
  power_is_off_ = status == SdoSequence::Status::kDone;
  power_is_on_ = !power_is_off_ && sdo.failure() == 0;  // its statusword says so
  stage_ = Stage::kFinished;
  if (!power_is_off_ || !ours_) return;
  out.push(encode_nmt({NmtCommand::kPreOperational, node_}));
  sdo.start(release_steps_);
  stage_ = Stage::kReleasing;
}

bool Cia402Startup::busy() const noexcept {
  return stage_ == Stage::kReset || stage_ == Stage::kAsking || stage_ == Stage::kIdentifying ||
         stage_ == Stage::kConfiguring || stage_ == Stage::kCheckingPower || stage_ == Stage::kReleasing;
}

}  // namespace tendril::hal
