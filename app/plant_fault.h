#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "hal/master_config.h"

namespace tendril::app {

struct Config;

/// What the simulated robot can be made to suffer.
enum class PlantFaultKind : std::uint8_t {
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

/// A line that is no fault; what() says what is expected in its place.
struct PlantFaultMistake : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads a line such as "heartbeat north off", "delay 5 ms" or "drop 10 %".
/// @param config  the robot: names of actuators and sensors; codes of drive faults are EMCY codes or an
/// ODrive axis' error bits
/// @throws PlantFaultMistake
/// Real-time: no (allocates).
PlantFault parse_plant_fault(std::string_view line, const Config& config);

/// All lines that parse_plant_fault takes, each with what it does, for people.
/// Real-time: no (allocates).
std::string plant_fault_help(hal::Protocol protocol);

}  // namespace tendril::app
