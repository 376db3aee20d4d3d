// SPDX-License-Identifier: Apache-2.0
#include "tests/scenario/robot_files.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>

#include "app/config/load_config.h"
#include "hal/cia402/cia402_protocol.h"
#include "hal/cia402/cia402_settings.h"
#include "tests/own_folder.h"
#include "tests/replace_each.h"

namespace tendril::app::testing {
namespace {

const std::filesystem::path kConfig = std::filesystem::path(TENDRIL_SOURCE_DIR) / "config";
constexpr double kRounding = 1e-11;  // s at the top rate

}  // namespace

Config shipped(const std::string& robot) { return load_config(kConfig / (robot + ".yaml")); }
Config finger() { return shipped("finger"); }
Config diamond() { return shipped("diamond"); }

std::string odrive_yaml(const std::string& robot, const std::string& firmware) {
  std::ifstream file(kConfig / (robot + ".yaml"));
  std::string yaml(std::istreambuf_iterator<char>(file), {});
  using tendril::testing::replace_each;
  replace_each(yaml, "file: ", "", "file: " + kConfig.string() + "/");
  replace_each(yaml, "counts_per_turn: ", ", ", "reference: absolute, ");
  replace_each(yaml, "  heartbeat", "\n", "");
  replace_each(yaml, "  master_node: ", "\n", "  protocol: odrive\n  firmware: " + firmware + "\n");
  replace_each(yaml, "id: 0x1F", "", "id: 0x7F");  // far from what the axes' nodes own
  return yaml;
}

Config with_odrive(const std::string& robot, const std::string& firmware) {
  const tendril::testing::OwnFolder folder;
  const auto file = folder / (robot + ".yaml");
  std::ofstream(file) << odrive_yaml(robot, firmware);
  return load_config(file);
}

Config on_efforts(Config config, const std::vector<int>& axes) {
  for (const int a : axes) {
    ActuatorConfig& actuator = config.actuators[a];
    actuator.drive.set_point = hal::SetPoint::kEffort;
    if (config.bus.master.protocol == &tendril::hal::cia402_protocol())
      tendril::hal::cia402_settings(actuator.drive).rated_torque =
          std::abs(actuator.drive.scale.to_torque(actuator.effort_max));
  }
  return config;
}

bool within_limits(const Config& config, const std::vector<rt::TraceRecord>& trace) {
  for (size_t k = 1; k < trace.size(); ++k) {
    // Drives without torque are told where they stand.
    if (trace[k].phase < rt::Phase::kRunning || trace[k].phase == rt::Phase::kStandby) continue;
    for (size_t a = 0; a < config.actuators.size(); ++a) {
      const ActuatorConfig& actuator = config.actuators[a];
      const double rounding = kRounding * actuator.top_rate;
      const double step = std::abs(trace[k].command[a] - trace[k - 1].command[a]);
      if (trace[k].command[a] > actuator.displacement_max + rounding ||
          trace[k].command[a] < actuator.displacement_min - rounding)
        return false;
      if (!actuator.follows_effort() && step > actuator.top_rate / config.control.rate_hz + rounding)
        return false;
    }
  }
  return true;
}

bool within_effort_limits(const Config& config, const std::vector<rt::TraceRecord>& trace) {
  for (const rt::TraceRecord& record : trace)
    for (size_t a = 0; a < config.actuators.size(); ++a) {
      const ActuatorConfig& actuator = config.actuators[a];
      if (!std::isfinite(record.lambda[a])) return false;
      if (record.phase >= rt::Phase::kEnabling && actuator.follows_effort() &&
          (record.lambda[a] < actuator.effort_min || record.lambda[a] > actuator.effort_max))
        return false;
    }
  return true;
}

std::vector<double> tracking_errors_mm(const Config& config, const VirtualRig& rig) {
  const auto rows = effector_rows(config);
  std::vector<double> errors;
  for (const PlantMeasurement& seen : rig.measurements()) {
    if (seen.stamp_ns < rig.motion()->path_start_ns()) continue;
    const rt::EffectorVector wanted = rig.motion()->at(seen.stamp_ns).position;
    double sum = 0;
    for (size_t r = 0; r < rows.size(); ++r)
      if (rows[r].effector == 0) sum += std::pow(wanted[r] - seen.tip[rows[r].axis], 2);
    errors.push_back(1e3 * std::sqrt(sum));
  }
  return errors;
}

double largest_model_error(const VirtualRig& rig, int e) {
  double largest = 0;
  for (const rt::TraceRecord& record : rig.trace())
    if (record.intended_ns >= rig.motion()->path_start_ns())
      largest = std::max(largest, 1e3 * std::abs(record.p_e[e] - record.desired[e]));
  return largest;
}

double heartbeat_timeout_s(const Config& config) {
  return 1e-9 * static_cast<double>(config.bus.master.heartbeat_timeout_ns);
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

}  // namespace tendril::app::testing
