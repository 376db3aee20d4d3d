// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "hal/bus/frame.h"

/// The drive profile CiA 402 as values: power state machine, PDOs and units. The functions keep no state.
namespace tendril::hal {

/// States of the power drive system [CiA 402-2, finite state automaton].
enum class DriveState : uint8_t {
  kNotReady,
  kSwitchOnDisabled,
  kReady,
  kSwitchedOn,
  kEnabled,
  kQuickStop,
  kFaultReaction,
  kFault,
  kUnknown  // a statusword that CiA 402 does not define
};

/// "operation enabled" and so on. Real-time: yes.
const char* name(DriveState state) noexcept;

/// The state that a statusword (object 6041) reports. Real-time: yes.
DriveState decode_statusword(uint16_t statusword) noexcept;

/// The state bits (0-3, 5, 6) of the statusword of a state. Real-time: yes.
uint16_t encode_statusword(DriveState state) noexcept;

// Bits of the statusword beside the state.
inline constexpr uint16_t kVoltageEnabled = 1u << 4;
inline constexpr uint16_t kRemote = 1u << 9;
inline constexpr uint16_t kTargetReached = 1u << 10;
inline constexpr uint16_t kInternalLimit = 1u << 11;
inline constexpr uint16_t kFollowsCommand = 1u << 12;  // cyclic synchronous modes
inline constexpr uint16_t kFollowingError = 1u << 13;  // position modes
inline constexpr uint16_t kHomingAttained = 1u << 12;  // homing mode
inline constexpr uint16_t kHomingError = 1u << 13;     // homing mode

// Controlwords (object 6040).
inline constexpr uint16_t kDisableVoltage = 0x00;
inline constexpr uint16_t kQuickStopWord = 0x02;
inline constexpr uint16_t kShutdown = 0x06;
inline constexpr uint16_t kSwitchOn = 0x07;  // from "operation enabled": disable operation
inline constexpr uint16_t kEnableOperation = 0x0F;
inline constexpr uint16_t kFaultReset = 0x80;   // acts on its rising edge
inline constexpr uint16_t kHalt = 0x100;        // stand still, "operation enabled"
inline constexpr uint16_t kStartHoming = 0x10;  // homing mode; its rising edge starts, its end interrupts

// Modes of operation, the values of objects 6060 and 6061.
inline constexpr int8_t kModeHoming = 6;
inline constexpr int8_t kModeCyclicPosition = 8;
inline constexpr int8_t kModeCyclicTorque = 10;

// Objects of PDOs as they are mapped: index, subindex and bits.
inline constexpr uint32_t kMapControlword = 0x6040'0010, kMapStatusword = 0x6041'0010,
                          kMapActualPosition = 0x6064'0020, kMapTargetPosition = 0x607A'0020,
                          kMapTargetTorque = 0x6071'0010;

// Homing methods that search a limit switch (object 6098).
inline constexpr int kHomingToNegativeSwitch = 17, kHomingToPositiveSwitch = 18;

/// Homing methods that take the present position for the reference, without any motion (object 6098).
constexpr bool homes_in_place(int method) noexcept { return method == 35 || method == 37; }

/// The state of a drive after a controlword: one transition at most.
/// @param previous  the controlword before, for the rising edge of the fault reset
/// @return          `state` itself where the controlword requests nothing that is allowed there
/// Real-time: yes.
DriveState transition(DriveState state, uint16_t controlword, uint16_t previous) noexcept;

/// The controlword that brings a drive one step nearer to a goal.
/// @param goal  kEnabled: 06, 07, 0F, with a fault reset before where `state` is kFault;
///              anything else means kSwitchOnDisabled: 07, 06, 00, so that the drive stops before voltage
///              goes
/// Real-time: yes.
uint16_t next_controlword(DriveState state, DriveState goal) noexcept;

/// RPDO 1 as this program maps it for positions: controlword and target position, 6 bytes.
struct DriveCommand {
  uint16_t controlword = 0;  // 6040
  int32_t target = 0;        // 607A, counts
};

/// RPDO 1 as this program maps it for torques: controlword and target torque, 4 bytes.
struct TorqueCommand {
  uint16_t controlword = 0;  // 6040
  int16_t torque = 0;        // 6071, thousandths of the rated torque
};

/// TPDO 1 as this program maps it: statusword and actual position, 6 bytes.
struct DriveFeedback {
  uint16_t statusword = 0;  // 6041
  int32_t position = 0;     // 6064, counts
};

/// Packs RPDO 1. @param cob_id  its 11-bit identifier. Real-time: yes.
Frame encode_drive_command(uint32_t cob_id, const DriveCommand& command) noexcept;

/// Unpacks RPDO 1. @return nothing where the frame has another identifier or is shorter.
/// Real-time: yes.
std::optional<DriveCommand> decode_drive_command(uint32_t cob_id, const Frame& frame) noexcept;

/// Packs and unpacks the RPDO for torques in the same way. Real-time: yes.
Frame encode_torque_command(uint32_t cob_id, const TorqueCommand& command) noexcept;
std::optional<TorqueCommand> decode_torque_command(uint32_t cob_id, const Frame& frame) noexcept;

/// Packs TPDO 1. @param cob_id  its 11-bit identifier. Real-time: yes.
Frame encode_drive_feedback(uint32_t cob_id, const DriveFeedback& feedback) noexcept;

/// Unpacks TPDO 1. @return nothing where the frame has another identifier or is shorter.
/// Real-time: yes.
std::optional<DriveFeedback> decode_drive_feedback(uint32_t cob_id, const Frame& frame) noexcept;

/// A SYNC period as object 60C2 holds it: value · 10^exponent seconds.
struct InterpolationPeriod {
  static constexpr int8_t kMilliseconds = -3;  // the exponent

  uint8_t value = 0;    // 60C2:1, 1..255
  int8_t exponent = 0;  // 60C2:2, -6..0

  /// The period that the drive will use, ns. Real-time: yes.
  int64_t nanoseconds() const noexcept;
};

/// The value of 60C2 nearest to a period. Of several, the one in milliseconds, the only unit of many drives,
/// or else the one with the greatest exponent. A period that is no round number is met to within 2 % (600
/// Hz: 167 · 10⁻⁵ s, 0.2 % too long).
/// @param period_ns  1 µs to 255 s
/// Real-time: yes.
InterpolationPeriod nearest_interpolation_period(int64_t period_ns) noexcept;

}  // namespace tendril::hal
