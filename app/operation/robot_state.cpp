// SPDX-License-Identifier: Apache-2.0
#include "app/operation/robot_state.h"

#include <algorithm>

#include "app/operation/coordinates.h"
#include "app/operation/fault_advice.h"
#include "app/robot/control_stack.h"

namespace tendril::app {
namespace {

using nlohmann::ordered_json;

}  // namespace

RobotState::RobotState(const Config& config, const hal::DriveMaster& master)
    : config_(config), master_(master), coordinates_(coordinate_names(config)), readings_(readings(config)) {}

ordered_json RobotState::by_coordinate(const double* values) const {
  auto result = ordered_json::object();
  for (std::size_t r = 0; r < coordinates_.size(); ++r) result[coordinates_[r]] = values[r];
  return result;
}

/// What sensors told last, of effectors and of efforts, and when.
ordered_json RobotState::measured(const rt::TraceRecord& record) const {
  auto result = ordered_json::object();
  for (const Reading& reading : readings_) {
    const MeasuredConfig& measures = reading.measures;
    const std::string name = measures.actuator >= 0
                                 ? config_.actuators[measures.actuator].name + ".effort"
                                 : config_.effectors[measures.effector].name + "." + "xyz"[measures.axis];
    const int64_t stamp_ns = record.sensors.stamp_ns[reading.sensor];
    if (stamp_ns > 0)
      // A sample that came after the intended wake-up is of this instant.
      result[name] = {
          {"value", record.sensors.value[reading.signal]},
          {"age", 1e-9 * static_cast<double>(std::max<int64_t>(0, record.intended_ns - stamp_ns))}};
    else
      result[name] = nullptr;
  }
  return result;
}

ordered_json RobotState::describe(const rt::TraceRecord& record) const {
  const bool running = record.phase >= rt::Phase::kRunning;
  ordered_json state;
  state["time"] = 1e-9 * static_cast<double>(record.intended_ns);
  state["phase"] = rt::name(record.phase);
  state["target"] = running ? by_coordinate(record.desired.data()) : ordered_json();
  state["model"] = running ? by_coordinate(record.p_e.data()) : ordered_json();
  state["measured"] = measured(record);
  state["actuators"] = ordered_json::object();
  for (std::size_t a = 0; a < config_.actuators.size(); ++a)
    state["actuators"][config_.actuators[a].name] = {{"command", record.command[a]},
                                                     {"displacement", record.measured[a]},
                                                     {"effort", record.lambda[a]},
                                                     {"power", hal::name(record.power[a])}};
  state["qp"] = {{"status", record.qp_solved ? ordered_json(qp::name(record.qp_status)) : ordered_json()},
                 {"iterations", record.qp_iterations}};
  state["snapshot_age"] = 1e-9 * static_cast<double>(record.snapshot_age_ns);
  state["snapshot"] = record.snapshot_sequence;
  state["cycle_time"] = 1e-9 * static_cast<double>(record.cycle_ns);
  state["cycles"] = record.cycles;
  state["late_cycles"] = record.late_cycles;
  state["faults"] = ordered_json::array();
  for (const rt::FaultRule& rule : rt::kFaultTable)
    if (record.faults.has(rule.fault)) state["faults"].push_back(rule.words);
  state["fault"] = nullptr;
  if (record.latched.present)
    state["fault"] = {{"what", app::describe(record.latched, config_, master_)},
                      {"since", 1e-9 * static_cast<double>(record.latched.since_ns)},
                      {"do", advice(record.latched)}};
  return state;
}

}  // namespace tendril::app
