#include "app/robot/bus_check.h"

#include <fmt/format.h>

#include "app/robot/robot.h"
#include "hal/protocols/drive_protocol.h"
#include "hal/protocols/frame_layout.h"

namespace tendril::app {

hal::BusBudget check_bus(const Config& config) {
  const hal::MasterConfig master = master_config(config);
  const auto refuse = [&](const std::string& what) {
    throw ConfigError(fmt::format("{}:{}: bus: {}", config.file.string(), config.bus.line, what));
  };
  try {
    hal::check(master);
  } catch (const std::invalid_argument& error) {
    refuse(error.what());
  }
  const auto traffic = hal::periodic_frames(master);
  hal::BusBudget budget = hal::judge_bus(traffic, config.bus.bitrate);
  if (budget.verdict == hal::BusBudget::Verdict::kExceeds) refuse(budget.text);
  return budget;
}

std::string advice_on_power_on(const Config& config) {
  std::string names;
  for (const ActuatorConfig& actuator : config.actuators)
    if (actuator.drive.counts_from_power_on.value_or(false))
      names += fmt::format("{}'{}'", names.empty() ? "" : ", ", actuator.name);
  if (names.empty()) return "";
  return fmt::format(
      "drive.reference is power_on of {}: these must get power where their displacement is drive.offset, "
      "in the shape of the mesh unless it is given; nothing else tells where they stand",
      names);
}

std::string bus_dbc(const Config& config) {
  check_bus(config);
  std::vector<hal::DisplacementUnit> units;
  for (const ActuatorConfig& actuator : config.actuators) units.push_back(displacement_unit(actuator));
  return hal::to_dbc(hal::frame_layouts(master_config(config), units));
}

}  // namespace tendril::app
