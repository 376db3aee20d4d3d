// SPDX-License-Identifier: Apache-2.0
#include "hal/odrive/odrive.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include "hal/bus/little_endian.h"
#include "hal/drive/formatted.h"

namespace tendril::hal {
namespace {

constexpr uint32_t kMessageMask = 0x1F;
constexpr float kFeedForwardStep = 0.001f;

// Firmware 0.5: one bit for each component that has an error of its own, and of the byte in which it comes.
constexpr uint8_t kComponents = 3;
constexpr uint8_t kTrajectoryDone_0_5 = 0x80;  // in the last byte

struct Bit {
  uint32_t mask;
  const char* words;
};

constexpr Bit kErrors_0_5[] = {{0x1, "invalid state"},
                               {0x40, "motor failed"},
                               {0x80, "sensorless estimator failed"},
                               {0x100, "encoder failed"},
                               {0x200, "controller failed"},
                               {0x800, "watchdog timer expired"},
                               {0x1000, "lower endstop pressed"},
                               {0x2000, "upper endstop pressed"},
                               {0x4000, "emergency stop requested"},
                               {0x2'0000, "homing without endstop"},
                               {0x4'0000, "over-temperature"},
                               {0x8'0000, "unknown position"}};

constexpr Bit kErrors_0_6[] = {{0x1, "initializing"},
                               {0x2, "system level"},
                               {0x4, "timing error"},
                               {0x8, "missing estimate"},
                               {0x10, "bad configuration"},
                               {0x20, "gate driver fault"},
                               {0x40, "missing input"},
                               {0x100, "DC bus over-voltage"},
                               {0x200, "DC bus under-voltage"},
                               {0x400, "DC bus over-current"},
                               {0x800, "DC bus over-regeneration current"},
                               {0x1000, "current limit violated"},
                               {0x2000, "motor over-temperature"},
                               {0x4000, "inverter over-temperature"},
                               {0x8000, "velocity limit violated"},
                               {0x1'0000, "position limit violated"},
                               {0x100'0000, "watchdog timer expired"},
                               {0x200'0000, "emergency stop requested"},
                               {0x400'0000, "spinout detected"},
                               {0x800'0000, "brake resistor disarmed"},
                               {0x1000'0000, "thermistor disconnected"},
                               {0x4000'0000, "calibration error"}};

Frame frame_of(int node, OdriveMessage message, uint8_t length) noexcept {
  return {.id = odrive_id(node, message), .length = length};
}

/// True where the frame is that message of or to that node and long enough to be read.
bool carries(const Frame& frame, int node, OdriveMessage message, int length) noexcept {
  return !frame.extended && frame.id == odrive_id(node, message) && frame.length >= length;
}

void put_float(Frame& frame, int at, float value) noexcept {
  put(frame.data, at, std::bit_cast<uint32_t>(value));
}

float get_float(const Frame& frame, int at) noexcept {
  return std::bit_cast<float>(get<uint32_t>(frame.data, at));
}

Frame pair_of(int node, OdriveMessage message, float first, float second) noexcept {
  Frame frame = frame_of(node, message, 8);
  put_float(frame, 0, first);
  put_float(frame, 4, second);
  return frame;
}

int16_t feed_forward(float value) noexcept {
  const float steps = std::round(value / kFeedForwardStep);
  return static_cast<int16_t>(std::isfinite(steps) ? std::clamp(steps, -32767.0f, 32767.0f) : 0.0f);
}

}  // namespace

std::optional<OdriveMessage> odrive_message(const Frame& frame, int node) noexcept {
  if (frame.extended || frame.id >> 5 != static_cast<uint32_t>(node)) return std::nullopt;
  const auto message = static_cast<OdriveMessage>(frame.id & kMessageMask);
  switch (message) {
    case OdriveMessage::kVersion:
    case OdriveMessage::kHeartbeat:
    case OdriveMessage::kEstop:
    case OdriveMessage::kError:
    case OdriveMessage::kSetAxisState:
    case OdriveMessage::kEncoderEstimates:
    case OdriveMessage::kSetControllerMode:
    case OdriveMessage::kSetInputPosition:
    case OdriveMessage::kSetInputTorque:
    case OdriveMessage::kSetLimits:
    case OdriveMessage::kIq:
    case OdriveMessage::kTemperature:
    case OdriveMessage::kBusVoltageCurrent:
    case OdriveMessage::kClearErrors:
      return message;
  }
  return std::nullopt;
}

Frame encode_odrive_heartbeat(int node, OdriveFirmware firmware, const OdriveHeartbeat& heartbeat) noexcept {
  Frame frame = frame_of(node, OdriveMessage::kHeartbeat, 8);
  put(frame.data, 0, heartbeat.axis_error);
  frame.data[4] = heartbeat.state;
  if (firmware == OdriveFirmware::k0_6) {
    frame.data[5] = heartbeat.procedure_result;
    frame.data[6] = heartbeat.trajectory_done;
    return frame;
  }
  for (int i = 0; i < kComponents; ++i) frame.data[5 + i] = heartbeat.component_errors >> i & 1;
  if (heartbeat.trajectory_done) frame.data[7] |= kTrajectoryDone_0_5;
  return frame;
}

std::optional<OdriveHeartbeat> decode_odrive_heartbeat(const Frame& frame, int node,
                                                       OdriveFirmware firmware) noexcept {
  if (!carries(frame, node, OdriveMessage::kHeartbeat, 8)) return std::nullopt;
  OdriveHeartbeat heartbeat{.axis_error = get<uint32_t>(frame.data, 0), .state = frame.data[4]};
  if (firmware == OdriveFirmware::k0_6) {
    heartbeat.procedure_result = frame.data[5];
    heartbeat.trajectory_done = frame.data[6] & 1;
    return heartbeat;
  }
  for (int i = 0; i < kComponents; ++i)
    heartbeat.component_errors =
        static_cast<uint8_t>(heartbeat.component_errors | (frame.data[5 + i] & 1) << i);
  heartbeat.trajectory_done = frame.data[7] & kTrajectoryDone_0_5;
  return heartbeat;
}

Frame encode_odrive_estimates(int node, const OdriveEstimates& estimates) noexcept {
  return pair_of(node, OdriveMessage::kEncoderEstimates, estimates.position, estimates.velocity);
}

std::optional<OdriveEstimates> decode_odrive_estimates(const Frame& frame, int node) noexcept {
  if (!carries(frame, node, OdriveMessage::kEncoderEstimates, 8)) return std::nullopt;
  return OdriveEstimates{get_float(frame, 0), get_float(frame, 4)};
}

Frame encode_odrive_input(int node, const OdriveInput& input) noexcept {
  Frame frame = frame_of(node, OdriveMessage::kSetInputPosition, 8);
  put_float(frame, 0, input.position);
  put(frame.data, 4, feed_forward(input.velocity));
  put(frame.data, 6, feed_forward(input.torque));
  return frame;
}

std::optional<OdriveInput> decode_odrive_input(const Frame& frame, int node) noexcept {
  if (!carries(frame, node, OdriveMessage::kSetInputPosition, 8)) return std::nullopt;
  return OdriveInput{get_float(frame, 0), kFeedForwardStep * get<int16_t>(frame.data, 4),
                     kFeedForwardStep * get<int16_t>(frame.data, 6)};
}

Frame encode_odrive_torque(int node, float torque) noexcept {
  Frame frame = frame_of(node, OdriveMessage::kSetInputTorque, 4);
  put_float(frame, 0, torque);
  return frame;
}

std::optional<float> decode_odrive_torque(const Frame& frame, int node) noexcept {
  if (!carries(frame, node, OdriveMessage::kSetInputTorque, 4)) return std::nullopt;
  return get_float(frame, 0);
}

Frame encode_odrive_version(int node, const OdriveVersion& version) noexcept {
  Frame frame = frame_of(node, OdriveMessage::kVersion, 8);
  frame.data[0] = version.protocol;
  std::copy(version.hardware.begin(), version.hardware.end(), frame.data.begin() + 1);
  std::copy(version.firmware.begin(), version.firmware.end(), frame.data.begin() + 4);
  return frame;
}

Frame encode_odrive_error(int node, uint32_t active, uint32_t disarm_reason) noexcept {
  Frame frame = frame_of(node, OdriveMessage::kError, 8);
  put(frame.data, 0, active);
  put(frame.data, 4, disarm_reason);
  return frame;
}

Frame encode_odrive_iq(int node, float set_point, float measured) noexcept {
  return pair_of(node, OdriveMessage::kIq, set_point, measured);
}

Frame encode_odrive_temperature(int node, float power_stage, float motor) noexcept {
  return pair_of(node, OdriveMessage::kTemperature, power_stage, motor);
}

Frame encode_odrive_supply(int node, float voltage, float current) noexcept {
  return pair_of(node, OdriveMessage::kBusVoltageCurrent, voltage, current);
}

Frame encode_odrive_state(int node, uint32_t state) noexcept {
  Frame frame = frame_of(node, OdriveMessage::kSetAxisState, 4);
  put(frame.data, 0, state);
  return frame;
}

std::optional<uint32_t> decode_odrive_state(const Frame& frame, int node) noexcept {
  if (!carries(frame, node, OdriveMessage::kSetAxisState, 4)) return std::nullopt;
  return get<uint32_t>(frame.data, 0);
}

Frame encode_odrive_mode(int node, const OdriveMode& mode) noexcept {
  Frame frame = frame_of(node, OdriveMessage::kSetControllerMode, 8);
  put(frame.data, 0, mode.control);
  put(frame.data, 4, mode.input);
  return frame;
}

std::optional<OdriveMode> decode_odrive_mode(const Frame& frame, int node) noexcept {
  if (!carries(frame, node, OdriveMessage::kSetControllerMode, 8)) return std::nullopt;
  return OdriveMode{get<uint32_t>(frame.data, 0), get<uint32_t>(frame.data, 4)};
}

Frame encode_odrive_limits(int node, const OdriveLimits& limits) noexcept {
  return pair_of(node, OdriveMessage::kSetLimits, limits.velocity, limits.current);
}

std::optional<OdriveLimits> decode_odrive_limits(const Frame& frame, int node) noexcept {
  if (!carries(frame, node, OdriveMessage::kSetLimits, 8)) return std::nullopt;
  return OdriveLimits{get_float(frame, 0), get_float(frame, 4)};
}

Frame encode_odrive_clear_errors(int node) noexcept { return frame_of(node, OdriveMessage::kClearErrors, 0); }

std::string describe_odrive_error(OdriveFirmware firmware, uint32_t bits) {
  const std::span<const Bit> known = firmware == OdriveFirmware::k0_5 ? std::span<const Bit>(kErrors_0_5)
                                                                      : std::span<const Bit>(kErrors_0_6);
  if (bits == 0) return "no error";
  std::string words;
  const auto add = [&words](const std::string& more) { words += (words.empty() ? "" : ", ") + more; };
  for (const Bit& bit : known) {
    if (bits & bit.mask) add(bit.words);
    bits &= ~bit.mask;
  }
  if (bits != 0) add(formatted("unknown bits 0x%X", bits));
  return words;
}

const char* describe_odrive_axis_state(uint8_t state) noexcept {
  constexpr const char* kStates[] = {"undefined",
                                     "idle",
                                     "startup sequence",
                                     "full calibration",
                                     "motor calibration",
                                     "sensorless control",
                                     "encoder index search",
                                     "encoder offset calibration",
                                     "closed-loop control",
                                     "lock-in spin",
                                     "encoder direction search",
                                     "homing",
                                     "Hall polarity calibration",
                                     "Hall phase calibration",
                                     "anticogging calibration"};
  return state < std::size(kStates) ? kStates[state] : "a state without a name";
}

const char* describe_odrive_result(uint8_t result) noexcept {
  constexpr const char* kResults[] = {"success",
                                      "busy",
                                      "cancelled",
                                      "disarmed",
                                      "no response",
                                      "pole pairs and counts per revolution do not match",
                                      "phase resistance out of range",
                                      "phase inductance out of range",
                                      "unbalanced phases",
                                      "invalid motor type",
                                      "illegal Hall state",
                                      "timeout",
                                      "homing without endstop",
                                      "invalid state",
                                      "not calibrated",
                                      "not converging"};
  return result < std::size(kResults) ? kResults[result] : "a result without a name";
}

}  // namespace tendril::hal
