// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "app/config/config_error.h"
#include "app/config/load_config.h"
#include "app/config/master_config.h"
#include "hal/drive/drive_protocol.h"
#include "hal/sim/simulated_actuator.h"
#include "hal/sim/simulated_drive.h"
#include "tests/fuzz/inputs.h"
#include "tests/fuzz/scratch.h"

namespace tendril::fuzz {
namespace {

void check_actuator(const app::ActuatorConfig& actuator) {
  must(actuator.effort_min <= actuator.effort_max, "limits of efforts are in order");
  must(actuator.displacement_min <= actuator.displacement_max, "limits of displacements are in order");
  must(std::isfinite(actuator.displacement_max - actuator.displacement_min), "a range is finite");
  must(actuator.top_rate > 0 && std::isfinite(actuator.top_rate), "an actuator has a finite speed");
}

/// What is built of a robot before its mesh is looked into.
void build(const app::Config& config) {
  const hal::MasterConfig master = app::master_config(config);
  must(hal::make_master(master) != nullptr, "a robot file that is taken has a master");
  std::vector<hal::DisplacementUnit> units;
  for (const app::ActuatorConfig& actuator : config.actuators)
    units.push_back(actuator.is_cavity() ? hal::DisplacementUnit{"ml", 1e6}
                                         : hal::DisplacementUnit{"mm", 1e3});
  must(!hal::frame_layouts(master, units).empty(), "there are frames");
  for (const hal::PeriodicFrames& frames : hal::periodic_frames(master))
    must(std::isfinite(frames.rate_hz) && frames.rate_hz >= 0, "frames have a finite rate");
  for (size_t a = 0; config.plant && a < config.actuators.size(); ++a) {
    const app::ActuatorConfig& actuator = config.actuators[a];
    const hal::SimulatedActuator simulated{
        .top_rate = actuator.top_rate,
        .displacement_range = actuator.displacement_max - actuator.displacement_min,
        .left_enabled = config.plant->drives.left_enabled,
        .position_gain = config.plant->drives.position_gain,
        .protocol_settings = config.plant->drives.protocol_settings};
    const auto drive = master.protocol->make_simulated_drive(master, static_cast<int>(a), simulated);
    must(std::isfinite(drive->displacement()), "a simulated drive stands somewhere");
  }
}

}  // namespace

bool feed_robot_file(const std::string& bytes) {
  static const auto mesh = scratch_file("body.msh", "not looked into\n");
  try {
    const app::Config config = app::load_config(scratch_file("robot.yaml", bytes));
    must(config.gravity.allFinite() && !config.effectors.empty() && !config.actuators.empty(),
         "a robot is complete");
    std::ranges::for_each(config.actuators, check_actuator);
    build(config);
    return true;
  } catch (const app::ConfigError&) {
    return false;
  }
}

}  // namespace tendril::fuzz
