// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/cia402_axis.h"

#include "hal/canopen/canopen.h"
#include "hal/canopen/emergency.h"
#include "hal/cia402/cia402_settings.h"
#include "hal/cia402/cia402_setup.h"

namespace tendril::hal {
namespace {

// Reads the error code; no value is expected.
const SdoStep kReadErrorCode[] = {{.request = {SdoRequest::Kind::kRead, {0x603F, 0}, 0, 0}, .mask = 0}};

/// Whether a fault ends the start-up of its drive.
bool ends_startup(FaultKind kind) noexcept {
  return kind == FaultKind::kStartTimeout || kind == FaultKind::kConfiguration ||
         kind == FaultKind::kUnexpectedValue;
}

/// Whether after a fault the state of its drive is not known any more.
bool is_loss_of_contact(FaultKind kind) noexcept {
  return kind == FaultKind::kHeartbeatLost || kind == FaultKind::kFeedbackLost ||
         kind == FaultKind::kDriveRestarted;
}

}  // namespace

Cia402Axis::Cia402Axis(const AxisConfig& axis, const MasterConfig& config)
    : config_(config),
      node_(axis.node),
      tpdo_id_(tpdo_cob_id(axis)),
      sdo_(axis.node, cia402_settings(config).sdo_timeout_ns, cia402_settings(config).sdo_attempts),
      startup_(axis, config),
      power_(axis, config) {}

void Cia402Axis::receive(const Frame& frame, int64_t arrival_ns) noexcept {
  if (const auto feedback = decode_drive_feedback(tpdo_id_, frame)) {
    if (synchronous()) latch(power_.on_feedback(*feedback, arrival_ns));
  } else if (const auto state = decode_heartbeat(frame, node_)) {
    latch(startup_.on_heartbeat(*state, arrival_ns, sdo_));
  } else if (const auto emergency = decode_emergency(frame, node_)) {
    on_emergency(emergency->code);
  } else if (const auto answer = decode_sdo_answer(frame, node_)) {
    startup_.on_sdo_answer(*answer, sdo_);
  }
}

void Cia402Axis::on_emergency(uint16_t code) noexcept {
  if (fault_.kind == FaultKind::kDriveFault && fault_.code == 0) fault_.code = code;
  const DriveFault fault = power_.on_emergency(code);
  if (startup_.running()) latch(fault);
}

void Cia402Axis::supervise(int64_t now_ns, int64_t last_sync_ns) noexcept {
  if (!synchronous() || faulty()) return;
  latch(startup_.supervise(now_ns));
  if (startup_.running()) latch(power_.supervise(now_ns, startup_.stage_since_ns(), last_sync_ns));
}

void Cia402Axis::set_up(int64_t now_ns, FrameBatch& out) noexcept {
  if (!startup_.running()) {
    latch(startup_.advance(now_ns, sdo_, out));
    if (startup_.power_is_off()) power_.confirm_off();
  } else if (reads_error_code_) {
    read_error_code(now_ns, out);
  } else if (power_.transferring()) {
    latch(power_.transfer(now_ns, sdo_, out));
  }
}

void Cia402Axis::read_error_code(int64_t now_ns, FrameBatch& out) noexcept {
  const SdoSequence::Status status = sdo_.advance(now_ns, out);
  reads_error_code_ = status == SdoSequence::Status::kRunning;
  if (status == SdoSequence::Status::kDone && fault_.code == 0) fault_.code = sdo_.found() & 0xFFFF;
}

void Cia402Axis::drive(Task task, bool may_begin, bool all_enabled, const AxisTarget& target, int64_t now_ns,
                       FrameBatch& out) noexcept {
  if (!startup_.running() || position_stamp_ns() == 0) return;
  out.push(power_.command(task, faulty(), may_begin && monitors_us_, all_enabled, target, now_ns, sdo_));
}

void Cia402Axis::restart() noexcept {
  startup_.restart();
  power_.restart();
  reads_error_code_ = monitors_us_ = false;
  fault_ = {};
}

/// Who restarted the drive may be another controller, which then has set it up.
void Cia402Axis::release() noexcept {
  if (!reads_error_code_)
    startup_.release(fault_.kind != FaultKind::kDriveRestarted, power_.may_be_on(), sdo_);
}

bool Cia402Axis::connected(int64_t last_sync_ns) const noexcept {
  return startup_.running() && position_stamp_ns() != 0 &&
         last_sync_ns - position_stamp_ns() <= config_.feedback_timeout_ns;
}

/// A drive whose state is not known stops by its own heartbeat consumer; no statusword will confirm that.
DrivePower Cia402Axis::power() const noexcept {
  if (!power_.may_be_on()) return DrivePower::kOff;
  if (startup_.power_is_on()) return DrivePower::kOn;
  return !startup_.running() || is_loss_of_contact(fault_.kind) ? DrivePower::kUnknown : DrivePower::kOn;
}

void Cia402Axis::latch(const DriveFault& fault) noexcept {
  if (faulty() || fault.kind == FaultKind::kNone) return;
  fault_ = fault;
  if (fault.kind != FaultKind::kDriveFault) fault_.emergency = power_.emergency();
  power_.stop();
  if (ends_startup(fault.kind)) startup_.give_up();
  reads_error_code_ = fault.kind == FaultKind::kDriveFault && fault.code == 0;
  if (reads_error_code_) sdo_.start(kReadErrorCode);
}

}  // namespace tendril::hal
