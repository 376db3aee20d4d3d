// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/bus/frame.h"
#include "hal/odrive/odrive_settings.h"

/// ODrive's CANSimple as bytes and as values, of both firmware families. The functions keep no state.
///
/// Sources: firmware 0.5, docs/can-protocol.rst, docs/_static/can-protocol.csv and
/// Firmware/communication/can/can_simple.cpp of odriverobotics/ODrive; firmware 0.6, "CAN Protocol" at
/// docs.odriverobotics.com and the values that odrive-cansimple.dbc of 0.5.6 and 0.6.10 name.
namespace tendril::hal {

/// Numbers of the supported messages: the low five bits of the identifier. An axis answers a remote frame,
/// or one without data, with the values of that message. It also sends heartbeats and encoder estimates
/// without a request, each in its own period.
enum class OdriveMessage : uint8_t {
  kVersion = 0x00,  // firmware 0.6 only
  kHeartbeat = 0x01,
  kEstop = 0x02,
  kError = 0x03,  // firmware 0.6 only; in 0.5 it is the motor's errors
  kSetAxisState = 0x07,
  kEncoderEstimates = 0x09,
  kSetControllerMode = 0x0B,
  kSetInputPosition = 0x0C,
  kSetInputTorque = 0x0E,
  kSetLimits = 0x0F,
  kIq = 0x14,
  kTemperature = 0x15,  // firmware 0.6 only; in 0.5 it is the sensorless estimates
  kBusVoltageCurrent = 0x17,
  kClearErrors = 0x18
};

inline constexpr int kOdriveNodes = 64;  // 0..63
/// The node of an axis that has no address yet, to which all axes listen; firmware 0.6.
inline constexpr int kOdriveUnaddressed = 63;

/// The identifier of a message to or from a node: node << 5 | message.
/// @param node  0..63
/// Real-time: yes.
constexpr uint32_t odrive_id(int node, OdriveMessage message) noexcept {
  return static_cast<uint32_t>(node) << 5 | static_cast<uint32_t>(message);
}

/// The message that a frame of or to `node` carries. @return nothing where the frame is another node's, or
/// its message is not supported. Real-time: yes.
std::optional<OdriveMessage> odrive_message(const Frame& frame, int node) noexcept;

// States of an axis (AXIS_STATE) that Tendril uses. Others are calibrations and searches.
inline constexpr uint8_t kOdriveUndefined = 0, kOdriveIdle = 1, kOdriveClosedLoop = 8;

// Controller modes (CONTROL_MODE, INPUT_MODE).
inline constexpr uint32_t kOdriveTorqueControl = 1, kOdrivePositionControl = 3, kOdrivePassthrough = 1;

// Error bits that the simulated drive sets.
inline constexpr uint32_t kOdriveInvalidState_0_5 = 0x1, kOdriveOverTemperature_0_5 = 0x4'0000,
                          kOdriveInverterOverTemperature_0_6 = 0x4000;

/// The error bits of an expired watchdog and of an emergency stop. Real-time: yes.
constexpr uint32_t odrive_watchdog_error(OdriveFirmware firmware) noexcept {
  return firmware == OdriveFirmware::k0_5 ? 0x800 : 0x0100'0000;
}
constexpr uint32_t odrive_estop_error(OdriveFirmware firmware) noexcept {
  return firmware == OdriveFirmware::k0_5 ? 0x4000 : 0x0200'0000;
}

// Results of a procedure, firmware 0.6: the result of the last request of a state.
inline constexpr uint8_t kOdriveSuccess = 0, kOdriveDisarmed = 3, kOdriveInvalidState = 13,
                         kOdriveNotCalibrated = 14;

/// The heartbeat of an axis, sent every 100 ms as delivered.
struct OdriveHeartbeat {
  uint32_t axis_error = 0;  // bits, 0: none
  uint8_t state = 0;
  uint8_t component_errors = 0;  // 0.5: 1 motor, 2 encoder, 4 controller has an error of its own
  uint8_t procedure_result = 0;  // 0.6
  bool trajectory_done = false;
};

/// The frame of a heartbeat. Real-time: yes.
Frame encode_odrive_heartbeat(int node, OdriveFirmware firmware, const OdriveHeartbeat& heartbeat) noexcept;

/// Reads a heartbeat. @return nothing where the frame is none of `node`. Real-time: yes.
std::optional<OdriveHeartbeat> decode_odrive_heartbeat(const Frame& frame, int node,
                                                       OdriveFirmware firmware) noexcept;

/// The encoder estimates of an axis.
struct OdriveEstimates {
  float position = 0;  // rev; NaN where the axis has no position
  float velocity = 0;  // rev/s
};

/// The frame of encoder estimates. Real-time: yes.
Frame encode_odrive_estimates(int node, const OdriveEstimates& estimates) noexcept;

/// Reads encoder estimates. @return nothing where the frame is none of `node`, or a request for them.
/// Real-time: yes.
std::optional<OdriveEstimates> decode_odrive_estimates(const Frame& frame, int node) noexcept;

/// The input of position control.
struct OdriveInput {
  float position = 0;  // rev
  float velocity = 0;  // rev/s, feed-forward; in steps of 0.001, ±32.767 at most
  float torque = 0;    // Nm, feed-forward; in steps of 0.001, ±32.767 at most
};

/// The frame of an input position; feed-forwards are rounded and kept to what the frame can hold.
/// Real-time: yes.
Frame encode_odrive_input(int node, const OdriveInput& input) noexcept;

/// Reads an input position. @return nothing where the frame is none for `node`. Real-time: yes.
std::optional<OdriveInput> decode_odrive_input(const Frame& frame, int node) noexcept;

/// The frame of an input torque. @param torque  Nm. Real-time: yes.
Frame encode_odrive_torque(int node, float torque) noexcept;

/// Reads an input torque, Nm. @return nothing where the frame is none for `node`. Real-time: yes.
std::optional<float> decode_odrive_torque(const Frame& frame, int node) noexcept;

/// Versions of an axis.
struct OdriveVersion {
  uint8_t protocol = 2;
  std::array<uint8_t, 3> hardware{};            // major, minor, variant
  std::array<uint8_t, 4> firmware{0, 6, 0, 0};  // major, minor, revision, 1 where it was never released
};

/// The frame of a version. Real-time: yes.
Frame encode_odrive_version(int node, const OdriveVersion& version) noexcept;

/// The frame of error bits.
/// @param active         the present errors
/// @param disarm_reason  the errors that ended closed-loop control last, until they are cleared
/// Real-time: yes.
Frame encode_odrive_error(int node, uint32_t active, uint32_t disarm_reason) noexcept;

/// The frame of the torque-producing currents Iq, set-point and measured, A. Real-time: yes.
Frame encode_odrive_iq(int node, float set_point, float measured) noexcept;

/// The frame of the temperatures of power stage and motor, °C. Real-time: yes.
Frame encode_odrive_temperature(int node, float power_stage, float motor) noexcept;

/// The frame of supply voltage and supply current, V and A. Real-time: yes.
Frame encode_odrive_supply(int node, float voltage, float current) noexcept;

/// The frame that requests a state of the axis. Real-time: yes.
Frame encode_odrive_state(int node, uint32_t state) noexcept;

/// Reads a requested state. @return nothing where the frame is none for `node`. Real-time: yes.
std::optional<uint32_t> decode_odrive_state(const Frame& frame, int node) noexcept;

/// The controller mode of an axis.
struct OdriveMode {
  uint32_t control = kOdrivePositionControl;
  uint32_t input = kOdrivePassthrough;
};

/// The frame of a controller mode. Real-time: yes.
Frame encode_odrive_mode(int node, const OdriveMode& mode) noexcept;

/// Reads a controller mode. @return nothing where the frame is none for `node`. Real-time: yes.
std::optional<OdriveMode> decode_odrive_mode(const Frame& frame, int node) noexcept;

/// The limits of an axis.
struct OdriveLimits {
  float velocity = 0;  // rev/s
  float current = 0;   // A
};

/// The frame of limits. Real-time: yes.
Frame encode_odrive_limits(int node, const OdriveLimits& limits) noexcept;

/// Reads limits. @return nothing where the frame is none for `node`. Real-time: yes.
std::optional<OdriveLimits> decode_odrive_limits(const Frame& frame, int node) noexcept;

/// The frame that clears all errors. Real-time: yes.
Frame encode_odrive_clear_errors(int node) noexcept;

/// Error bits in words: "watchdog timer expired, spinout detected"; bits of no known meaning as a number.
/// Real-time: no (allocates).
std::string describe_odrive_error(OdriveFirmware firmware, uint32_t bits);

/// "closed-loop control" and so on. Real-time: yes.
const char* describe_odrive_axis_state(uint8_t state) noexcept;

/// A result of a procedure, firmware 0.6: "not calibrated" and so on. Real-time: yes.
const char* describe_odrive_result(uint8_t result) noexcept;

}  // namespace tendril::hal
