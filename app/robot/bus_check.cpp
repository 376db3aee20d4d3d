// SPDX-License-Identifier: Apache-2.0
#include "app/robot/bus_check.h"

#include <fmt/format.h>

#include "app/config/master_config.h"
#include "app/robot/robot.h"
#include "hal/drive/drive_protocol.h"

namespace tendril::app {

hal::BusBudget check_bus(const Config& config) {
  const hal::MasterConfig master = master_config(config);
  hal::BusBudget budget =
      hal::judge_bus(master.protocol->wire(), hal::periodic_frames(master), config.bus.bitrate);
  if (budget.verdict == hal::BusBudget::Verdict::kExceeds)
    throw ConfigError(fmt::format("{}:{}: bus: {}", config.file.string(), config.bus.line, budget.text));
  return budget;
}

std::vector<std::string> warnings_on_drives(const Config& config) {
  const hal::MasterConfig master = master_config(config);
  return master.protocol->warnings(master);
}

std::vector<std::string> advice_on_drives(const Config& config) {
  const hal::MasterConfig master = master_config(config);
  return master.protocol->advice(master);
}

std::string warning_on_queue(const Config& config, const std::string& bus, int frames) {
  const int needed = hal::frames_in_cycle(static_cast<int>(config.actuators.size()));
  if (frames == 0 || frames >= needed) return "";
  return fmt::format(
      "the transmit queue of {0} holds {1} frames, and a cycle has {2}: what finds no room is lost. Make it "
      "longer: "
      "ip link set {0} txqueuelen {3}. More than {3} frames never wait there",
      bus, frames, needed, hal::kWaitingCycles * needed);
}

std::string bus_dbc(const Config& config) {
  check_bus(config);
  std::vector<hal::DisplacementUnit> units;
  for (const ActuatorConfig& actuator : config.actuators) units.push_back(displacement_unit(actuator));
  return hal::to_dbc(hal::frame_layouts(master_config(config), units));
}

}  // namespace tendril::app
