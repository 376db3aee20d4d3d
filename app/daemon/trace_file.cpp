// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/trace_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace tendril::app {
namespace {

/// x, y and z of the first effector as cells; those that are not controlled stay empty.
std::string cells(const double* coordinates, const std::vector<int>& axes) {
  std::string xyz[3];
  for (size_t k = 0; k < axes.size(); ++k) xyz[axes[k]] = fmt::format("{:.7f}", coordinates[k]);
  return fmt::format(",{},{},{}", xyz[0], xyz[1], xyz[2]);
}

/// Name of a phase in the trace: the way to the path and the path itself are told apart.
const char* phase_name(const rt::TraceRecord& record, const Motion* motion) {
  if (approaches(record, motion)) return "approach";
  if (record.phase == rt::Phase::kStandby) return rt::name(record.phase);
  return record.phase >= rt::Phase::kStopping ? "stop" : rt::name(record.phase);
}

}  // namespace

bool approaches(const rt::TraceRecord& record, const Motion* motion) {
  return record.phase == rt::Phase::kRunning && motion && record.intended_ns < motion->path_start_ns();
}

TraceFile::TraceFile(const Config& config, const std::filesystem::path& file)
    : config_(config), signals_(config), csv_(file) {
  if (!csv_)
    throw std::runtime_error(
        fmt::format("cannot write {}: choose another folder with --report", file.string()));
  write_header();
}

void TraceFile::write_header() {
  csv_ << "t_s,phase,target_x_m,target_y_m,target_z_m,model_x_m,model_y_m,model_z_m,"
          "measured_x_m,measured_y_m,measured_z_m,measured_t_s";
  for (std::size_t a = 0; a < config_.actuators.size(); ++a) {
    const ActuatorConfig& actuator = config_.actuators[a];
    const char* effort = actuator.is_cavity() ? "Pa" : "N";
    csv_ << fmt::format(",command_{0}_{1},displacement_{0}_{1},effort_{0}_{2}", actuator.name,
                        actuator.is_cavity() ? "m3" : "m", effort);
    if (signals_.efforts[a]) csv_ << fmt::format(",measured_{}_{}", actuator.name, effort);
  }
  for (const Reading& other : signals_.others)
    csv_ << fmt::format(",measured_{}_{}_m", config_.effectors[other.measures.effector].name,
                        "xyz"[other.measures.axis]);
  csv_ << ",qp_status,qp_iterations,snapshot_age_s,wakeup_us,cycle_us\n";
}

std::string TraceFile::cell(const rt::TraceRecord& record, const std::optional<Reading>& reading,
                            int decimals) const {
  if (!reading || !new_samples_.has(record, *reading)) return ",";
  return fmt::format(",{:.{}f}", record.sensors.value[reading->signal], decimals);
}

std::string TraceFile::tip_cells(const rt::TraceRecord& record) const {
  std::string cells;
  int64_t newest_ns = 0;
  for (const auto& reading : signals_.tip) {
    cells += cell(record, reading, 7);
    if (reading && new_samples_.has(record, *reading))
      newest_ns = std::max(newest_ns, record.sensors.stamp_ns[reading->sensor]);
  }
  return cells + (newest_ns == 0 ? "," : fmt::format(",{:.6f}", seconds(newest_ns)));
}

void TraceFile::add(const rt::TraceRecord& record, const Motion* motion) {
  if (first_ns_ == 0) first_ns_ = record.intended_ns;
  std::string row = fmt::format("{:.6f},{}", seconds(record.intended_ns), phase_name(record, motion));
  const bool running = record.phase >= rt::Phase::kRunning;
  row += running ? cells(record.desired.data(), signals_.tip_axes) : ",,,";
  row += running ? cells(record.p_e.data(), signals_.tip_axes) : ",,,";
  row += tip_cells(record);
  for (size_t a = 0; a < config_.actuators.size(); ++a) {
    const bool cavity = config_.actuators[a].is_cavity();  // to 0.1 µm and 1 mm³, to 10 µN and 0.1 Pa
    row += fmt::format(",{0:.{3}f},{1:.{3}f},{2:.{4}f}", record.command[a], record.measured[a],
                       record.lambda[a], cavity ? 11 : 7, cavity ? 2 : 5);
    if (signals_.efforts[a]) row += cell(record, signals_.efforts[a], cavity ? 2 : 5);
  }
  for (const Reading& other : signals_.others) row += cell(record, other, 7);
  row +=
      fmt::format(",{},{},{:.6f},{:.2f},{:.2f}\n", record.qp_solved ? qp::name(record.qp_status) : "",
                  record.qp_iterations, 1e-9 * static_cast<double>(record.snapshot_age_ns),
                  1e-3 * static_cast<double>(record.wakeup_ns), 1e-3 * static_cast<double>(record.cycle_ns));
  csv_ << row;
  new_samples_.pass(record);
}

bool TraceFile::close() {
  csv_.close();
  return !csv_.fail();
}

}  // namespace tendril::app
