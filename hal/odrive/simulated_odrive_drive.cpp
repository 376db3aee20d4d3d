// SPDX-License-Identifier: Apache-2.0
#include "hal/odrive/simulated_odrive_drive.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tendril::hal {
namespace {

constexpr float kRoom_C = 25, kHot_C = 121;  // a power stage fails above 120 °C, as delivered

}  // namespace

SimulatedOdriveDrive::SimulatedOdriveDrive(const SimulatedOdriveSpec& spec) noexcept
    : spec_(spec),
      servo_(spec.top_speed, spec.tuning, spec.position),
      reports_position_(!spec.late_estimator) {
  input_.position = static_cast<float>(spec.position);
  if (spec.left_enabled) state_ = kOdriveClosedLoop;
}

void SimulatedOdriveDrive::receive(const Frame& frame, int64_t now_ns, FrameBatch& out) noexcept {
  advance(now_ns, out);
  if (frame.extended || frame.id >> 5 != static_cast<uint32_t>(spec_.node)) return;
  fed_ns_ = now_ns;
  if (const auto message = odrive_message(frame, spec_.node)) handle(*message, frame, out);
}

void SimulatedOdriveDrive::handle(OdriveMessage message, const Frame& frame, FrameBatch& out) noexcept {
  switch (message) {
    case OdriveMessage::kVersion:
    case OdriveMessage::kHeartbeat:
    case OdriveMessage::kError:
    case OdriveMessage::kEncoderEstimates:
    case OdriveMessage::kIq:
    case OdriveMessage::kTemperature:
    case OdriveMessage::kBusVoltageCurrent:
      if (frame.length == 0) answer(message, out);
      break;
    case OdriveMessage::kEstop:
      inject_fault(odrive_estop_error(spec_.firmware));
      break;
    case OdriveMessage::kSetAxisState:
      if (const auto state = decode_odrive_state(frame, spec_.node)) request_state(*state);
      break;
    case OdriveMessage::kSetControllerMode:
      if (const auto mode = decode_odrive_mode(frame, spec_.node)) mode_ = *mode;
      break;
    case OdriveMessage::kSetInputPosition:
      if (const auto input = decode_odrive_input(frame, spec_.node); input && std::isfinite(input->position))
        input_ = *input;
      break;
    case OdriveMessage::kSetInputTorque:
      if (const auto torque = decode_odrive_torque(frame, spec_.node); torque && std::isfinite(*torque))
        input_torque_ = *torque;
      break;
    case OdriveMessage::kSetLimits:
      if (const auto limits = decode_odrive_limits(frame, spec_.node)) servo_.limit_speed(limits->velocity);
      break;
    case OdriveMessage::kClearErrors:
      error_ = disarm_reason_ = 0;
      component_errors_ = 0;
      break;
  }
}

/// Answers a request, unless the firmware does not have that message.
void SimulatedOdriveDrive::answer(OdriveMessage message, FrameBatch& out) const noexcept {
  const bool is_0_6 = spec_.firmware == OdriveFirmware::k0_6;
  const auto iq = static_cast<float>(torque() / spec_.torque_constant);
  const double power = 2 * std::numbers::pi * torque() * servo_.velocity();
  switch (message) {
    case OdriveMessage::kEncoderEstimates:
      out.push(estimates());
      break;
    case OdriveMessage::kIq:
      out.push(encode_odrive_iq(spec_.node, iq, iq));
      break;
    case OdriveMessage::kBusVoltageCurrent:
      out.push(encode_odrive_supply(spec_.node, static_cast<float>(spec_.supply_voltage),
                                    static_cast<float>(power / spec_.supply_voltage)));
      break;
    case OdriveMessage::kVersion:
      if (is_0_6) out.push(encode_odrive_version(spec_.node, {}));
      break;
    case OdriveMessage::kHeartbeat:
      if (is_0_6) out.push(heartbeat());
      break;
    case OdriveMessage::kError:
      if (is_0_6) out.push(encode_odrive_error(spec_.node, error_, disarm_reason_));
      break;
    case OdriveMessage::kTemperature:
      if (is_0_6) out.push(encode_odrive_temperature(spec_.node, is_too_hot() ? kHot_C : kRoom_C, kRoom_C));
      break;
    default:
      break;
  }
}

void SimulatedOdriveDrive::request_state(uint32_t state) noexcept {
  if (state == kOdriveIdle) {
    state_ = kOdriveIdle;
    result_ = kOdriveSuccess;
  } else if (state != kOdriveClosedLoop) {
    refuse_state(kOdriveInvalidState);
  } else if (!spec_.calibrated) {
    refuse_state(kOdriveNotCalibrated);
  } else if (error_ != 0) {
    refuse_state(kOdriveDisarmed);
  } else {
    if (!reports_position_) input_ = {.position = static_cast<float>(servo_.position())};
    reports_position_ = true;
    state_ = kOdriveClosedLoop;
    result_ = kOdriveSuccess;
    disarm_reason_ = 0;
  }
}

Frame SimulatedOdriveDrive::heartbeat() const noexcept {
  return encode_odrive_heartbeat(spec_.node, spec_.firmware,
                                 {.axis_error = error_,
                                  .state = state_,
                                  .component_errors = component_errors_,
                                  .procedure_result = result_});
}

/// The torque of the motor against its load, Nm.
double SimulatedOdriveDrive::torque() const noexcept {
  return state_ == kOdriveClosedLoop ? std::clamp(load_, -1.0, 1.0) * spec_.torque_limit : 0;
}

void SimulatedOdriveDrive::set_load(double load) noexcept {
  load_ = load;
  servo_.set_load(load);
}

Frame SimulatedOdriveDrive::estimates() const noexcept {
  if (!reports_position_) return encode_odrive_estimates(spec_.node, {});
  return encode_odrive_estimates(
      spec_.node, {static_cast<float>(reported_position()), static_cast<float>(servo_.velocity())});
}

double SimulatedOdriveDrive::reported_position() const noexcept {
  return std::round(servo_.position() * spec_.encoder_counts) / spec_.encoder_counts;
}

void SimulatedOdriveDrive::refuse_state(uint8_t result) noexcept {
  disarm();
  result_ = result;
  if (spec_.firmware == OdriveFirmware::k0_5) error_ |= kOdriveInvalidState_0_5;
}

void SimulatedOdriveDrive::advance(int64_t now_ns, FrameBatch& out) noexcept {
  if (!started_) fed_ns_ = now_ns;
  started_ = true;
  move(now_ns);
  if (spec_.watchdog_ns > 0 && now_ns - fed_ns_ > spec_.watchdog_ns)
    inject_fault(odrive_watchdog_error(spec_.firmware));
  if (now_ns >= next_estimates_ns_) {
    out.push(estimates());
    next_estimates_ns_ = now_ns + spec_.encoder_period_ns;
  }
  if (now_ns >= next_heartbeat_ns_) {
    out.push(heartbeat());
    next_heartbeat_ns_ = now_ns + spec_.heartbeat_ns;
  }
}

void SimulatedOdriveDrive::move(int64_t now_ns) noexcept {
  const bool controls = state_ == kOdriveClosedLoop && mode_.input == kOdrivePassthrough;
  if (controls && mode_.control == kOdrivePositionControl) {
    servo_.unlock();
    servo_.pass_through(input_.position, input_.velocity);
  } else if (controls && mode_.control == kOdriveTorqueControl) {
    servo_.unlock();
    servo_.apply_force(input_torque_ / spec_.torque_limit);
  } else {
    servo_.lock();
  }
  servo_.advance(now_ns);
}

PowerStage SimulatedOdriveDrive::power_stage() const noexcept {
  if (error_ != 0) return PowerStage::kFault;
  return state_ == kOdriveClosedLoop ? PowerStage::kOn : PowerStage::kOff;
}

void SimulatedOdriveDrive::inject_fault(uint32_t error) noexcept {
  error_ |= error;
  disarm();
}

void SimulatedOdriveDrive::overheat() noexcept {
  inject_fault(spec_.firmware == OdriveFirmware::k0_5 ? kOdriveOverTemperature_0_5
                                                      : kOdriveInverterOverTemperature_0_6);
}

bool SimulatedOdriveDrive::is_too_hot() const noexcept {
  return spec_.firmware == OdriveFirmware::k0_6 && (error_ & kOdriveInverterOverTemperature_0_6) != 0;
}

void SimulatedOdriveDrive::unplug_motor() noexcept {
  if (spec_.firmware == OdriveFirmware::k0_5) component_errors_ |= 1;
  disarm();
}

void SimulatedOdriveDrive::disarm() noexcept {
  if (state_ == kOdriveClosedLoop) {
    result_ = kOdriveDisarmed;
    disarm_reason_ = error_;
  }
  state_ = kOdriveIdle;
}

}  // namespace tendril::hal
