// SPDX-License-Identifier: Apache-2.0
#include "app/operation/fault_advice.h"

namespace tendril::app {
namespace {

const char* advice_on_drive(hal::FaultKind kind) {
  using hal::FaultKind;
  switch (kind) {
    case FaultKind::kConfiguration:
      return "Check that the drive is on, has the node number of the robot file and the right bit rate, and "
             "that its "
             "firmware knows the object.";
    case FaultKind::kUnexpectedValue:
      return "Set the object in the drive as docs/connect-your-drives.md says, and store it there.";
    case FaultKind::kStartTimeout:
      return "Check that the drive is on and connected. Where it only starts slowly, raise bus.boot_timeout.";
    case FaultKind::kEnableTimeout:
      return "Look at the drive's own error display, its supply and its enable input. Where it only enables "
             "slowly, raise "
             "bus.enable_timeout.";
    case FaultKind::kDriveFault:
      return "Remove the cause that the drive names: load, supply, temperature or encoder.";
    case FaultKind::kDriveDisabled:
      return "Find out who disabled the drive: its enable input, a safety relay, another tool on the bus.";
    case FaultKind::kDriveRestarted:
      return "Check the drive's supply and its connectors: it has lost power or was reset.";
    case FaultKind::kOutOfRange:
      return "Bring the actuator back into its range by hand or with tendrilctl jog. Where it belongs there, "
             "widen its limits.";
    case FaultKind::kNotFollowing:
      return "Look for a blocked or overloaded actuator, a cable off its pulley, or a top_speed that the "
             "drive cannot reach.";
    case FaultKind::kFeedbackJumped:
    case FaultKind::kPositionJumped:
      return "Check the encoder and its cable. The drive's zero may have moved: refer it again.";
    case FaultKind::kNotReferenced:
    case FaultKind::kHomingFailed:
    case FaultKind::kHomingTimeout:
      return "Check the home switch or end stop and the homing method, and that nothing blocks the way.";
    case FaultKind::kHeartbeatLost:
    case FaultKind::kFeedbackLost:
      return "Check the drive's supply, its bus cable and the terminations.";
    case FaultKind::kOtherMaster:
      return "Stop the other controller: a bus has one.";
    case FaultKind::kBusPassive:
    case FaultKind::kBusOff:
      return "Check cable, terminations and bit rate of the bus.";
    case FaultKind::kBusStalled:
      return "Check that a drive is on and acknowledges frames, and the cable, terminations and bit rate of "
             "the bus.";
    case FaultKind::kBusDown:
      return "Check that the adapter is plugged in and bring the interface up: ip link set NAME up.";
    case FaultKind::kNone:
      break;
  }
  return "";
}

}  // namespace

const char* advice(const rt::LatchedFault& fault) {
  switch (fault.fault) {
    case rt::Fault::kDrives:
      return advice_on_drive(fault.drive.kind);
    case rt::Fault::kSensorLost:
      return "Check the sensor's supply and its bus cable. A robot that can do without it says on_loss: "
             "warn.";
    case rt::Fault::kLateCycles:
      return "Look what else runs on the control thread's CPU; docs/real-time.md says how to keep it free.";
    case rt::Fault::kModelFailed:
      return "Look whether an actuator stands far outside its usual range, and bring it back.";
    default:
      return "";
  }
}

}  // namespace tendril::app
