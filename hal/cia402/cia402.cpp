// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/cia402.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "hal/bus/little_endian.h"

namespace tendril::hal {
namespace {

/// The command of a controlword, by its bits 0-3 and 7 [CiA 402-2, table of commands].
enum class PowerCommand { kNone, kShutdown, kSwitchOn, kEnable, kDisableVoltage, kQuickStop };

PowerCommand command_of(uint16_t controlword) noexcept {
  if (controlword & kFaultReset) return PowerCommand::kNone;
  if (!(controlword & 0x02)) return PowerCommand::kDisableVoltage;
  if (!(controlword & 0x04)) return PowerCommand::kQuickStop;
  if (!(controlword & 0x01)) return PowerCommand::kShutdown;
  return controlword & 0x08 ? PowerCommand::kEnable : PowerCommand::kSwitchOn;
}

/// @tparam Value  of the second object
template <class Value>
constexpr uint8_t kPdoLength = sizeof(uint16_t) + sizeof(Value);

template <class Value>
Frame pack_pdo(uint32_t cob_id, uint16_t word, Value value) noexcept {
  Frame frame{.id = cob_id, .length = kPdoLength<Value>};
  put(frame.data, 0, word);
  put(frame.data, 2, value);
  return frame;
}

/// What a PDO carries beyond its mapping means nothing; one that is too short is dropped. [CiA 301, PDO
/// protocol]
template <class Value>
bool is_pdo(uint32_t cob_id, const Frame& frame) noexcept {
  return frame.id == cob_id && !frame.extended && !frame.remote && frame.length >= kPdoLength<Value>;
}

int64_t power_of_ten(int exponent) noexcept {
  int64_t power = 1;
  for (; exponent > 0; --exponent) power *= 10;
  return power;
}

}  // namespace

const char* name(DriveState state) noexcept {
  switch (state) {
    case DriveState::kNotReady:
      return "not ready to switch on";
    case DriveState::kSwitchOnDisabled:
      return "switch on disabled";
    case DriveState::kReady:
      return "ready to switch on";
    case DriveState::kSwitchedOn:
      return "switched on";
    case DriveState::kEnabled:
      return "operation enabled";
    case DriveState::kQuickStop:
      return "quick stop active";
    case DriveState::kFaultReaction:
      return "fault reaction active";
    case DriveState::kFault:
      return "fault";
    case DriveState::kUnknown:
      break;
  }
  return "unknown state";
}

DriveState decode_statusword(uint16_t statusword) noexcept {
  switch (statusword & 0x4F) {  // bit 5, quick stop, means nothing in these
    case 0x00:
      return DriveState::kNotReady;
    case 0x40:
      return DriveState::kSwitchOnDisabled;
    case 0x0F:
      return DriveState::kFaultReaction;
    case 0x08:
      return DriveState::kFault;
    default:
      break;
  }
  switch (statusword & 0x6F) {
    case 0x21:
      return DriveState::kReady;
    case 0x23:
      return DriveState::kSwitchedOn;
    case 0x27:
      return DriveState::kEnabled;
    case 0x07:
      return DriveState::kQuickStop;
    default:
      return DriveState::kUnknown;
  }
}

uint16_t encode_statusword(DriveState state) noexcept {
  switch (state) {
    case DriveState::kSwitchOnDisabled:
      return 0x40;
    case DriveState::kReady:
      return 0x21;
    case DriveState::kSwitchedOn:
      return 0x23;
    case DriveState::kEnabled:
      return 0x27;
    case DriveState::kQuickStop:
      return 0x07;
    case DriveState::kFaultReaction:
      return 0x0F;
    case DriveState::kFault:
      return 0x08;
    default:
      return 0x00;
  }
}

DriveState transition(DriveState state, uint16_t controlword, uint16_t previous) noexcept {
  const PowerCommand command = command_of(controlword);
  switch (state) {
    case DriveState::kSwitchOnDisabled:
      return command == PowerCommand::kShutdown ? DriveState::kReady : state;
    case DriveState::kReady:
      // Transition 3 also where 0F comes at once; 4 then follows with the next controlword.
      if (command == PowerCommand::kSwitchOn || command == PowerCommand::kEnable)
        return DriveState::kSwitchedOn;
      break;
    case DriveState::kSwitchedOn:
      if (command == PowerCommand::kEnable) return DriveState::kEnabled;
      if (command == PowerCommand::kShutdown) return DriveState::kReady;
      break;
    case DriveState::kEnabled:
      if (command == PowerCommand::kSwitchOn) return DriveState::kSwitchedOn;
      if (command == PowerCommand::kShutdown) return DriveState::kReady;
      if (command == PowerCommand::kQuickStop) return DriveState::kQuickStop;
      if (command == PowerCommand::kDisableVoltage) return DriveState::kSwitchOnDisabled;
      return state;
    case DriveState::kQuickStop:
      if (command == PowerCommand::kEnable) return DriveState::kEnabled;
      return command == PowerCommand::kDisableVoltage ? DriveState::kSwitchOnDisabled : state;
    case DriveState::kFault: {
      const bool rising = (controlword & kFaultReset) && !(previous & kFaultReset);
      return rising ? DriveState::kSwitchOnDisabled : state;
    }
    default:
      return state;  // left by the drive itself, not by a controlword
  }
  const bool off = command == PowerCommand::kDisableVoltage || command == PowerCommand::kQuickStop;
  return off ? DriveState::kSwitchOnDisabled : state;
}

uint16_t next_controlword(DriveState state, DriveState goal) noexcept {
  if (goal == DriveState::kEnabled) switch (state) {
      case DriveState::kSwitchOnDisabled:
        return kShutdown;
      case DriveState::kReady:
        return kSwitchOn;
      case DriveState::kSwitchedOn:
      case DriveState::kEnabled:
        return kEnableOperation;
      case DriveState::kFault:
        return kFaultReset;
      default:
        return kDisableVoltage;
    }
  switch (state) {
    case DriveState::kEnabled:
      return kSwitchOn;
    case DriveState::kSwitchedOn:
      return kShutdown;
    default:
      return kDisableVoltage;
  }
}

Frame encode_drive_command(uint32_t cob_id, const DriveCommand& command) noexcept {
  return pack_pdo(cob_id, command.controlword, command.target);
}

std::optional<DriveCommand> decode_drive_command(uint32_t cob_id, const Frame& frame) noexcept {
  if (!is_pdo<int32_t>(cob_id, frame)) return std::nullopt;
  return DriveCommand{get<uint16_t>(frame.data, 0), get<int32_t>(frame.data, 2)};
}

Frame encode_torque_command(uint32_t cob_id, const TorqueCommand& command) noexcept {
  return pack_pdo(cob_id, command.controlword, command.torque);
}

std::optional<TorqueCommand> decode_torque_command(uint32_t cob_id, const Frame& frame) noexcept {
  if (!is_pdo<int16_t>(cob_id, frame)) return std::nullopt;
  return TorqueCommand{get<uint16_t>(frame.data, 0), get<int16_t>(frame.data, 2)};
}

Frame encode_drive_feedback(uint32_t cob_id, const DriveFeedback& feedback) noexcept {
  return pack_pdo(cob_id, feedback.statusword, feedback.position);
}

std::optional<DriveFeedback> decode_drive_feedback(uint32_t cob_id, const Frame& frame) noexcept {
  if (!is_pdo<int32_t>(cob_id, frame)) return std::nullopt;
  return DriveFeedback{get<uint16_t>(frame.data, 0), get<int32_t>(frame.data, 2)};
}

int64_t InterpolationPeriod::nanoseconds() const noexcept {
  return value * power_of_ten(9 + std::clamp<int>(exponent, -9, 0));
}

InterpolationPeriod nearest_interpolation_period(int64_t period_ns) noexcept {
  InterpolationPeriod best;
  int64_t best_error = INT64_MAX;
  for (const int exponent : {int{InterpolationPeriod::kMilliseconds}, 0, -1, -2, -4, -5, -6}) {
    const int64_t unit = power_of_ten(9 + exponent);
    const int64_t value = std::clamp<int64_t>((period_ns + unit / 2) / unit, 1, 255);
    const int64_t error = std::abs(value * unit - period_ns);
    if (error < best_error) {
      best = {static_cast<uint8_t>(value), static_cast<int8_t>(exponent)};
      best_error = error;
    }
  }
  return best;
}

}  // namespace tendril::hal
