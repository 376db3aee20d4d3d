// SPDX-License-Identifier: Apache-2.0
#include "hal/odrive/odrive_axis.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tendril::hal {
namespace {

// A request of a state is repeated until a heartbeat confirms it: longer than the time between two of them.
constexpr int64_t kRepeat_ns = 500'000'000;

// Heartbeats that must come after the first frame that feeds the watchdog. The first one may have left before
// that frame arrived.
constexpr int kHeartbeatsFed = 2;

/// The nearest finite number of the wire.
float to_float(double value) noexcept {
  constexpr double kGreatest = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -kGreatest, kGreatest));
}

}  // namespace

OdriveAxis::OdriveAxis(const AxisConfig& axis, const MasterConfig& config)
    : config_(config),
      node_(axis.node),
      scale_(axis.scale),
      firmware_(odrive_settings(config).firmware),
      settings_(odrive_settings(axis)),
      follows_effort_(axis.set_point == SetPoint::kEffort),
      range_(axis),
      following_monitor_(axis, odrive_settings(config).encoder_period_ns) {}

void OdriveAxis::receive(const Frame& frame, int64_t arrival_ns) noexcept {
  if (const auto heartbeat = decode_odrive_heartbeat(frame, node_, firmware_))
    on_heartbeat(*heartbeat, arrival_ns);
  else if (const auto estimates = decode_odrive_estimates(frame, node_))
    on_estimates(*estimates, arrival_ns);
}

void OdriveAxis::on_heartbeat(const OdriveHeartbeat& heartbeat, int64_t arrival_ns) noexcept {
  heartbeat_ = heartbeat;
  heartbeat_ns_ = arrival_ns;
  heartbeats_fed_ = std::min(heartbeats_fed_ + 1, kHeartbeatsFed);
  judge_power();
  if (phase_ != Phase::kEnteringClosedLoop && phase_ != Phase::kOn) return;
  if (heartbeat.axis_error != 0)
    fail(FaultKind::kDriveFault, heartbeat.axis_error);
  else if (phase_ == Phase::kOn && !in_closed_loop())  // an unplugged motor shows in nothing else
    fail(FaultKind::kDriveDisabled, fault_code());
}

/// A heartbeat from before the last request says nothing of what came of it.
void OdriveAxis::judge_power() noexcept {
  const bool says_off = heartbeat_.state == kOdriveIdle || heartbeat_.state == kOdriveUndefined;
  if (!says_off)
    may_be_on_ = true;
  else if (requested_state_ != kOdriveClosedLoop && heartbeat_ns_ > requested_ns_)
    may_be_on_ = false;
}

void OdriveAxis::on_estimates(const OdriveEstimates& estimates, int64_t arrival_ns) noexcept {
  if (!std::isfinite(estimates.position)) return;  // as if no position had come
  position_ = estimates.position;
  position_stamp_ns_ = arrival_ns;
  if (phase_ == Phase::kOn) return monitor_motion(arrival_ns);
  if (phase_ != Phase::kEnteringClosedLoop || !in_closed_loop()) return;
  const double jump = position_ - position_before_;
  if (std::abs(jump) > kMaxPositionStep) {
    const double thousandths = std::clamp(std::round(1e3 * jump), -2e9, 2e9);
    return fail(FaultKind::kPositionJumped, static_cast<uint32_t>(static_cast<int32_t>(thousandths)));
  }
  target_ = position_;
  phase_ = Phase::kOn;
  following_monitor_.begin(position(), arrival_ns);
}

void OdriveAxis::monitor_motion(int64_t arrival_ns) noexcept {
  if (range_.is_outside(position()))
    return fail(FaultKind::kOutOfRange, static_cast<uint32_t>(range_.excess(position())));
  fail(following_monitor_.judge(position(), arrival_ns));
}

void OdriveAxis::supervise(int64_t now_ns, int64_t last_sync_ns) noexcept {
  if (stage_since_ns_ == 0) stage_since_ns_ = now_ns;
  silent_ = now_ns - std::max(heartbeat_ns_, stage_since_ns_) > config_.heartbeat_timeout_ns;
  if (stage_ == Stage::kListening) {
    if (heartbeat_ns_ != 0 && position_stamp_ns_ != 0)
      stage_ = Stage::kRunning;
    else if (now_ns - stage_since_ns_ > config_.start_timeout_ns)
      fail(FaultKind::kStartTimeout, heartbeat_ns_ != 0);
  }
  if (stage_ != Stage::kRunning || fault_.kind != FaultKind::kNone) return;
  if (silent_) return fail(FaultKind::kHeartbeatLost, 0);
  if (last_sync_ns - position_stamp_ns_ > config_.feedback_timeout_ns)
    return fail(FaultKind::kFeedbackLost, 0);
  const bool enabling = phase_ == Phase::kPreparing || phase_ == Phase::kEnteringClosedLoop;
  if (!enabling || now_ns - enabling_since_ns_ <= config_.enable_timeout_ns) return;
  if (heartbeat_.axis_error != 0)
    fail(FaultKind::kDriveFault, heartbeat_.axis_error);
  else
    fail(FaultKind::kEnableTimeout, fault_code());
}

void OdriveAxis::drive(bool enable, bool may_begin, bool may_request, bool all_enabled,
                       const AxisTarget& target, int64_t now_ns, FrameBatch& out) noexcept {
  // A pause may let the watchdog expire, and the heartbeats from before it do not tell.
  if (fed_ns_ == 0 || now_ns - fed_ns_ > config_.heartbeat_timeout_ns / 2) heartbeats_fed_ = 0;
  const auto before = out.size();
  act(enable, may_begin, may_request, all_enabled, target, now_ns, out);
  if (out.size() != before) fed_ns_ = now_ns;  // any frame feeds it
}

void OdriveAxis::act(bool enable, bool may_begin, bool may_request, bool all_enabled,
                     const AxisTarget& target, int64_t now_ns, FrameBatch& out) noexcept {
  const bool waits = stage_ == Stage::kListening || stage_ == Stage::kFailed;
  if (waits && !enable && may_be_on_) request_state(kOdriveIdle, now_ns, out);  // it was on before a restart
  if (stage_ != Stage::kRunning) return;
  if (std::isfinite(target.effort)) torque_ = scale_.to_torque(target.effort);
  if (!enable || fault_.kind != FaultKind::kNone) phase_ = Phase::kOff;
  if (enable && phase_ == Phase::kOff && fault_.kind == FaultKind::kNone && may_begin) {
    phase_ = Phase::kPreparing;
    enabling_since_ns_ = now_ns;
  }
  if (phase_ != Phase::kOn) following_ = false;
  switch (phase_) {
    case Phase::kOff:
      return disable(now_ns, out);
    case Phase::kPreparing:
      return ready_for_closed_loop() && may_request ? request_closed_loop(now_ns, out) : prepare(now_ns, out);
    case Phase::kEnteringClosedLoop:
      return wait_for_closed_loop(now_ns, out);
    case Phase::kOn:
      return follow(all_enabled, target.displacement, out);
  }
}

/// Brings the axis to idle and feeds its watchdog. The watchdog of a faulty axis is not fed.
void OdriveAxis::disable(int64_t now_ns, FrameBatch& out) noexcept {
  if (may_be_on_) {
    request_state(kOdriveIdle, now_ns, out);
    return;  // an input could move it: its position may be wrong
  }
  if (fault_.kind == FaultKind::kNone) append_idle_input(out);
}

/// Brings the axis to idle and clears its errors.
void OdriveAxis::prepare(int64_t now_ns, FrameBatch& out) noexcept {
  if (in_closed_loop()) {
    request_state(kOdriveIdle, now_ns, out);
    return;
  }
  if (has_errors() && heartbeat_ns_ > cleared_ns_) {  // once a heartbeat
    out.push(encode_odrive_clear_errors(node_));
    cleared_ns_ = heartbeat_ns_;
  }
  append_idle_input(out);
}

void OdriveAxis::request_closed_loop(int64_t now_ns, FrameBatch& out) noexcept {
  position_before_ = position_;
  range_.begin(position());
  append_mode(out);
  if (settings_.velocity_limit > 0)
    out.push(encode_odrive_limits(
        node_, {static_cast<float>(settings_.velocity_limit), static_cast<float>(settings_.current_limit)}));
  if (follows_effort_)  // before the power stage is on, so that enabling is no jump
    append_torque(torque_, out);
  else
    append_input(position_before_, 0, out);
  requested_state_ = kOdriveUndefined;
  request_state(kOdriveClosedLoop, now_ns, out);
  may_be_on_ = true;
  phase_ = Phase::kEnteringClosedLoop;
}

/// Repeats the controller mode: it feeds the watchdog and moves nothing. A request that came to nothing is
/// repeated with all that belongs before it, as the bus may have lost any of it. An input position could move
/// the axis: firmware 0.5 (commit 073da34, get_encoder_estimates_callback) sends the position 0 until
/// closed-loop control has connected the estimator, and that position would be commanded.
void OdriveAxis::wait_for_closed_loop(int64_t now_ns, FrameBatch& out) noexcept {
  if (heartbeat_.state == kOdriveIdle && now_ns - requested_ns_ >= kRepeat_ns)
    return request_closed_loop(now_ns, out);
  append_mode(out);
}

void OdriveAxis::follow(bool all_enabled, double displacement, FrameBatch& out) noexcept {
  if (follows_effort_) return append_torque(torque_, out);
  following_ = following_ || all_enabled;
  const double before = target_;
  if (following_ && std::isfinite(displacement)) target_ = scale_.to_position(displacement);
  following_monitor_.command(scale_.to_displacement(target_));
  // Without the feed-forward a moving axis lags by velocity / pos_gain: by 50 ms of motion with the default.
  append_input(target_, (target_ - before) * 1e9 / static_cast<double>(config_.period_ns), out);
}

/// Appends the request of a state, unless it was sent less than kRepeat_ns ago. @return whether it was
/// appended
bool OdriveAxis::request_state(uint8_t state, int64_t now_ns, FrameBatch& out) noexcept {
  if (requested_state_ == state && now_ns - requested_ns_ < kRepeat_ns) return false;
  out.push(encode_odrive_state(node_, state));
  requested_state_ = state;
  requested_ns_ = now_ns;
  return true;
}

/// Feeds the watchdog of an axis that is idle.
void OdriveAxis::append_idle_input(FrameBatch& out) const noexcept {
  if (follows_effort_)
    append_torque(0, out);
  else
    append_input(position_, 0, out);
}

void OdriveAxis::append_mode(FrameBatch& out) const noexcept {
  out.push(encode_odrive_mode(node_,
                              {.control = follows_effort_ ? kOdriveTorqueControl : kOdrivePositionControl}));
}

void OdriveAxis::append_torque(double torque, FrameBatch& out) const noexcept {
  out.push(encode_odrive_torque(node_, to_float(torque)));
}

void OdriveAxis::append_input(double position, double velocity, FrameBatch& out) const noexcept {
  out.push(encode_odrive_input(node_, {.position = to_float(position), .velocity = to_float(velocity)}));
}

void OdriveAxis::restart() noexcept {
  stage_ = Stage::kListening;
  stage_since_ns_ = heartbeat_ns_ = position_stamp_ns_ = cleared_ns_ = fed_ns_ = 0;
  phase_ = Phase::kOff;
  following_ = silent_ = false;
  fault_ = {};
}

bool OdriveAxis::ready_for_closed_loop() const noexcept {
  return (phase_ == Phase::kOff || phase_ == Phase::kPreparing) && heartbeat_.state == kOdriveIdle &&
         !has_errors() && heartbeats_fed_ == kHeartbeatsFed;
}

bool OdriveAxis::known(int64_t last_sync_ns) const noexcept {
  return stage_ == Stage::kRunning && last_sync_ns - position_stamp_ns_ <= config_.feedback_timeout_ns;
}

/// An axis that sends no heartbeat is stopped by its watchdog; no heartbeat will confirm that.
DrivePower OdriveAxis::power() const noexcept {
  if (!may_be_on_) return DrivePower::kOff;
  return silent_ ? DrivePower::kUnknown : DrivePower::kOn;
}

void OdriveAxis::fail(FaultKind kind, uint32_t code) noexcept { fail({.kind = kind, .code = code}); }

void OdriveAxis::fail(const DriveFault& fault) noexcept {
  if (fault_.kind != FaultKind::kNone || fault.kind == FaultKind::kNone) return;
  fault_ = fault;
  phase_ = Phase::kOff;
  if (fault.kind == FaultKind::kStartTimeout) stage_ = Stage::kFailed;
}

uint32_t OdriveAxis::fault_code() const noexcept {
  return heartbeat_.state | static_cast<uint32_t>(heartbeat_.procedure_result) << 8 |
         static_cast<uint32_t>(heartbeat_.component_errors) << 16;
}

}  // namespace tendril::hal
