// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "app/config/plant_fault_parser.h"
#include "hal/protocols/drive_protocols.h"
#include "tests/fuzz/inputs.h"

namespace tendril::fuzz {
namespace {

app::Config robot_with(const hal::DriveProtocol& protocol) {
  app::Config config;
  config.bus.master.protocol = &protocol;
  config.actuators.resize(3);
  config.actuators[0].name = "north";
  config.actuators[1].name = "push";
  config.actuators[1].kind = app::RodConfig{};
  config.actuators[2].name = "chamber";
  config.actuators[2].kind = app::CavityConfig{};
  config.sensors.resize(1);
  config.sensors[0].frame.name = "camera";
  return config;
}

bool parse_or_refuse(std::string_view line, const app::Config& config) {
  try {
    const app::PlantFault fault = app::parse_plant_fault(line, config);
    must(std::isfinite(fault.value) && fault.value >= 0, "a fault has a finite size");
    must(fault.axis >= -1 && fault.axis < 3, "a fault is one of an axis, of a sensor or of the robot");
    return true;
  } catch (const app::PlantFaultMistake&) {
    return false;
  }
}

}  // namespace

bool feed_plant_fault(const std::string& bytes) {
  bool taken = false;
  for (const hal::DriveProtocol* protocol : hal::drive_protocols())
    taken = parse_or_refuse(bytes, robot_with(*protocol)) || taken;
  return taken;
}

}  // namespace tendril::fuzz
