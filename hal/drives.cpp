#include "hal/drives.h"

namespace tendril::hal {

const char* describe(FaultKind kind) noexcept {
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
    case FaultKind::kPositionJumped:
      return "position jumped at enabling";
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
    case FaultKind::kBusPassive:
      return "bus error-passive";
    case FaultKind::kBusOff:
      return "bus-off";
    case FaultKind::kBusDown:
      return "bus down";
  }
  return "unknown fault";
}

}  // namespace tendril::hal
