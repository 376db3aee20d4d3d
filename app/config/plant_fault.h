// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendril::app {

/// What the simulated robot can be made to suffer.
enum class PlantFaultKind : uint8_t {
  kDriveFault,     // a drive fails with a code of its own
  kSilent,         // a drive's heartbeats no longer come, all else goes on
  kStuck,          // the mechanics of a drive are jammed
  kCut,            // a cable is cut: it never pulls again, though its drive turns
  kDelay,          // what the robot sends arrives late
  kDrop,           // frames are lost in both directions
  kNoise,          // measured positions err
  kForceNoise,     // measured tensions and forces err
  kPressureNoise,  // measured pressures err
  kSensorSilent,   // a sensor sends nothing
  kBusOff,         // the robot neither sends nor hears
  kClear           // all of it ends but what is cut, and drive faults, which the controller clears
};

/// One of them, to be injected now or at an instant.
struct PlantFault {
  PlantFaultKind kind = PlantFaultKind::kClear;
  int axis = -1;     // index of the actuator, or of the sensor; -1: of the robot as a whole
  double value = 0;  // kDriveFault the code; kDelay s; kDrop share, 0..1; noise its standard deviation, in SI
  double after = 0;  // s from the first look at the bus; of the robot file alone
};

}  // namespace tendril::app
