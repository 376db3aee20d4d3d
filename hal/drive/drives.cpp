// SPDX-License-Identifier: Apache-2.0
#include "hal/drive/drives.h"

#include <cstdlib>

#include "hal/drive/formatted.h"

namespace tendril::hal {

const char* name(DrivePower power) noexcept {
  switch (power) {
    case DrivePower::kOff:
      return "off";
    case DrivePower::kOn:
      return "on";
    case DrivePower::kUnknown:
      break;
  }
  return "unknown";
}

const char* name(FaultKind kind) noexcept {
  switch (kind) {
    case FaultKind::kNone:
      return "no fault";
    case FaultKind::kConfiguration:
      return "configuration failed";
    case FaultKind::kUnexpectedValue:
      return "drive is set up otherwise";
    case FaultKind::kStartTimeout:
      return "drive did not start";
    case FaultKind::kEnableTimeout:
      return "drive did not enable";
    case FaultKind::kDriveFault:
      return "drive fault";
    case FaultKind::kDriveDisabled:
      return "drive left operation unasked";
    case FaultKind::kDriveRestarted:
      return "drive restarted";
    case FaultKind::kOutOfRange:
      return "axis left its range of displacements";
    case FaultKind::kPositionJumped:
      return "position jumped at enabling";
    case FaultKind::kNotFollowing:
      return "axis does not follow";
    case FaultKind::kFeedbackJumped:
      return "position feedback implausible";
    case FaultKind::kNotReferenced:
      return "axis has no reference";
    case FaultKind::kHomingFailed:
      return "homing failed";
    case FaultKind::kHomingTimeout:
      return "homing did not end in time";
    case FaultKind::kHeartbeatLost:
      return "heartbeat lost";
    case FaultKind::kFeedbackLost:
      return "position feedback lost";
    case FaultKind::kOtherMaster:
      return "another controller commands these drives";
    case FaultKind::kBusStalled:
      return "bus takes no frames: is a plug loose, or does another device hold it?";
    case FaultKind::kBusPassive:
      return "bus error-passive";
    case FaultKind::kBusOff:
      return "bus-off";
    case FaultKind::kBusDown:
      return "bus down";
  }
  return "unknown fault";
}

std::string describe_other_master(const DriveFault& fault) {
  return name(fault.kind) +
         formatted(": its frames with identifier 0x%03X are on the bus. End it first", fault.code);
}

std::string describe_out_of_range(const DriveFault& fault) {
  const auto thousandths = static_cast<int32_t>(fault.code);
  return name(fault.kind) + formatted(", it is %.1f %% of it %s: check the actuator and its load",
                                      0.1 * std::abs(thousandths),
                                      thousandths < 0 ? "below the least" : "beyond the greatest");
}

}  // namespace tendril::hal
