// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/run_recorder.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>

#include "app/config/utf8.h"
#include "app/robot/robot.h"

namespace tendril::app {
namespace {

/// The folder, made where it is not there; whether that worked shows when the trace is opened.
const std::filesystem::path& made(const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  return directory;
}

nlohmann::json microseconds(const rt::Histogram& histogram) {
  nlohmann::json result;
  for (const double p : {50.0, 99.0, 99.9})
    result[fmt::format("p{}", p)] = 1e-3 * static_cast<double>(histogram.percentile_ns(p));
  result["max"] = 1e-3 * static_cast<double>(histogram.max_ns());
  return result;
}

/// @return  whether all of it is written
bool write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text << '\n';
  out.close();
  return bool(out);
}

std::runtime_error incomplete(const std::filesystem::path& directory) {
  return std::runtime_error(
      fmt::format("{}: the report could not be written in full; is the disk full?", directory.string()));
}

}  // namespace

RunRecorder::RunRecorder(const Config& config, const std::filesystem::path& directory)
    : config_(config),
      directory_(made(directory)),
      trace_(config, directory / "trace.csv"),
      statistics_(config) {}

void RunRecorder::finish(const RunFacts& facts, const rt::LoopCounts& counts) {
  const bool trace_complete = trace_.close();
  nlohmann::ordered_json summary;
  summary["robot"] = config_.robot;
  summary["configuration"] = config_.file.string();
  summary["nodes"] = facts.nodes;
  summary["tetrahedra"] = facts.tetrahedra;
  summary["actuators"] = config_.actuators.size();
  summary["effector_dofs"] = effector_rows(config_).size();
  summary["bus"] = facts.bus;
  summary["control_rate_hz"] = config_.control.rate_hz;
  summary["duration_s"] = statistics_.running_s();
  summary["cycles"] = counts.cycles;
  summary["late_cycles"] = counts.late_cycles;
  summary["success_rate"] = counts.success_rate();
  summary["model_refreshes"] = facts.model_refreshes;
  summary["model_rate_hz"] = facts.model_rate_hz;
  summary["tracking_error_mm"] = statistics_.tracking_error_mm();
  summary["model_error_mm"] = statistics_.model_error_mm();
  summary["target_to_model_mm"] = statistics_.target_to_model_mm();
  summary["effort_error"] = statistics_.effort_error();
  summary["following_error"] = statistics_.following_error();
  summary["sensors"] = statistics_.sensors();
  summary["qp"] = statistics_.qp();
  summary["qp"]["cap"] = facts.iteration_cap;
  summary["rt"] = {{"policy", counts.scheduling.policy},       {"priority", counts.scheduling.priority},
                   {"memory_locked", facts.memory_locked},     {"heap_calls", counts.heap_calls},
                   {"major_faults", counts.page_faults.major}, {"minor_faults", counts.page_faults.minor}};
  summary["wakeup_us"] = microseconds(counts.wakeup);
  summary["cycle_us"] = microseconds(counts.cycle);
  summary["bus_load"] = statistics_.bus_load();
  summary["trace_dropped"] = facts.trace_dropped;
  summary["bus_dropped"] = facts.bus_dropped;
  summary["faults"] = nlohmann::ordered_json::array();
  if (!facts.stop_reason.empty()) summary["faults"].push_back(facts.stop_reason);
  summary["warnings"] = statistics_.warnings();
  for (const std::string& fault : resets_) summary["warnings"].push_back("stopped, then reset: " + fault);

  const bool written = write_text(directory_ / "summary.json", to_text(summary, 2));
  if (!trace_complete || !written) throw incomplete(directory_);
}

void RunRecorder::add_geometry(const std::string& geometry) {
  if (!write_text(directory_ / "robot.json", geometry)) throw incomplete(directory_);
}

}  // namespace tendril::app
