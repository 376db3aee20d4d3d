#include "app/run_recorder.h"

#include <fmt/format.h>
#include <fmt/os.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>

#include "app/robot.h"

namespace tendril::app {
namespace {

// Samples of the tracker are at most this old when they arrive.
constexpr std::int64_t kMemory_ns = 1'000'000'000;

/// x, y and z of the first effector as cells; those that are not controlled stay empty.
std::string cells(const double* coordinates, const std::vector<int>& axes) {
  std::string xyz[3];
  for (size_t k = 0; k < axes.size(); ++k) xyz[axes[k]] = fmt::format("{:.7f}", coordinates[k]);
  return fmt::format(",{},{},{}", xyz[0], xyz[1], xyz[2]);
}

/// Name of a phase in the trace: the way to the path and the path itself are told apart.
const char* phase_name(const rt::TraceRecord& record, const Motion* motion) {
  if (record.phase == rt::Phase::kRunning && (!motion || record.intended_ns < motion->path_start_ns()))
    return "approach";
  return record.phase >= rt::Phase::kStopping ? "stop" : rt::name(record.phase);
}

nlohmann::json statistics(std::vector<double> values, bool with_p95) {
  if (values.empty()) return nullptr;
  std::sort(values.begin(), values.end());
  const double n = static_cast<double>(values.size());
  nlohmann::json result;
  result["mean"] = std::accumulate(values.begin(), values.end(), 0.0) / n;
  if (with_p95) result["p95"] = values[static_cast<size_t>(std::ceil(0.95 * n)) - 1];
  result["max"] = values.back();
  result["samples"] = values.size();
  return result;
}

nlohmann::json microseconds(const rt::Histogram& histogram) {
  nlohmann::json result;
  for (const double p : {50.0, 99.0, 99.9})
    result[fmt::format("p{}", p)] = 1e-3 * static_cast<double>(histogram.percentile_ns(p));
  result["max"] = 1e-3 * static_cast<double>(histogram.max_ns());
  return result;
}

}  // namespace

RunRecorder::RunRecorder(const Config& config, const std::filesystem::path& directory)
    : config_(config), directory_(directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  csv_.open(directory / "trace.csv");
  if (!csv_)
    throw std::runtime_error(fmt::format("cannot write {}: choose another folder with --report",
                                         (directory / "trace.csv").string()));
  const auto rows = effector_rows(config);
  effector_coordinates_ = static_cast<int>(rows.size());
  for (const EffectorRow& row : rows)
    if (row.effector == 0) tip_axes_.push_back(row.axis);

  csv_ << "t_s,phase,target_x_m,target_y_m,target_z_m,model_x_m,model_y_m,model_z_m,"
          "measured_x_m,measured_y_m,measured_z_m,measured_t_s";
  for (const ActuatorConfig& actuator : config.actuators)
    csv_ << fmt::format(",command_{0}_{1},displacement_{0}_{1},effort_{0}_{2}", actuator.name,
                        actuator.is_cavity() ? "m3" : "m", actuator.is_cavity() ? "Pa" : "N");
  csv_ << ",qp_status,qp_iterations,snapshot_age_s,wakeup_us,cycle_us\n";
}

void RunRecorder::add(const rt::TraceRecord& record, const Motion* motion) {
  if (first_ns_ == 0) first_ns_ = record.intended_ns;
  last_ns_ = record.intended_ns;
  const bool new_sample = record.tracker_stamp_ns > last_sample_ns_;
  last_sample_ns_ = std::max(last_sample_ns_, record.tracker_stamp_ns);
  write_row(record, motion, new_sample);

  if (record.phase == rt::Phase::kRunning) {
    if (running_since_ns_ == 0)
      running_since_ns_ = record.intended_ns;
    else
      bus_bits_ += record.bus_bits;  // those of the first cycle came before it
    running_until_ns_ = record.intended_ns;
    for (const rt::FaultRule& rule : rt::kFaultTable)
      if (record.faults.has(rule.fault)) ++fault_cycles_[static_cast<size_t>(rule.fault)];
    if (record.qp_solved) ++statuses_[qp::name(record.qp_status)];
    iterations_max_ = std::max(iterations_max_, record.qp_iterations);
    recent_.push_back(
        {record.intended_ns, Eigen::Map<const Eigen::VectorXd>(record.p_e.data(), effector_coordinates_)});
    while (recent_.front().stamp_ns < record.intended_ns - kMemory_ns) recent_.pop_front();
    if (new_sample && motion && record.tracker_stamp_ns >= motion->path_start_ns())
      judge_sample(record, *motion);
  }
}

void RunRecorder::write_row(const rt::TraceRecord& record, const Motion* motion, bool new_sample) {
  const auto seconds = [&](std::int64_t stamp_ns) {
    return 1e-9 * static_cast<double>(stamp_ns - first_ns_);
  };
  std::string row = fmt::format("{:.6f},{}", seconds(record.intended_ns), phase_name(record, motion));
  const bool running = record.phase >= rt::Phase::kRunning;
  row += running ? cells(record.desired.data(), tip_axes_) : ",,,";
  row += running ? cells(record.p_e.data(), tip_axes_) : ",,,";
  if (new_sample)
    row += fmt::format(",{:.5f},{:.5f},{:.5f},{:.6f}", record.tracker[0], record.tracker[1],
                       record.tracker[2], seconds(record.tracker_stamp_ns));
  else
    row += ",,,,";
  for (size_t a = 0; a < config_.actuators.size(); ++a) {
    const bool cavity = config_.actuators[a].is_cavity();  // to 0.1 µm and 1 mm³, to 10 µN and 0.1 Pa
    row += fmt::format(",{0:.{3}f},{1:.{3}f},{2:.{4}f}", record.command[a], record.measured[a],
                       record.lambda[a], cavity ? 11 : 7, cavity ? 2 : 5);
  }
  row +=
      fmt::format(",{},{},{:.6f},{:.2f},{:.2f}\n", record.qp_solved ? qp::name(record.qp_status) : "",
                  record.qp_iterations, 1e-9 * static_cast<double>(record.snapshot_age_ns),
                  1e-3 * static_cast<double>(record.wakeup_ns), 1e-3 * static_cast<double>(record.cycle_ns));
  csv_ << row;
}

double RunRecorder::distance_mm(const rt::EffectorVector& p, const std::array<double, 3>& measured) const {
  double sum = 0;
  for (size_t k = 0; k < tip_axes_.size(); ++k) sum += std::pow(p[k] - measured[tip_axes_[k]], 2);
  return 1e3 * std::sqrt(sum);
}

void RunRecorder::judge_sample(const rt::TraceRecord& record, const Motion& motion) {
  const std::int64_t stamp_ns = record.tracker_stamp_ns;
  last_error_mm_ = distance_mm(motion.at(stamp_ns).position, record.tracker);
  tracking_mm_.push_back(*last_error_mm_);
  const auto nearest = std::min_element(recent_.begin(), recent_.end(), [&](const auto& a, const auto& b) {
    return std::abs(a.stamp_ns - stamp_ns) < std::abs(b.stamp_ns - stamp_ns);
  });
  model_mm_.push_back(distance_mm(nearest->p_e, record.tracker));
}

void RunRecorder::finish(const RunFacts& facts, const rt::LoopCounts& counts) {
  csv_.close();
  nlohmann::ordered_json faults = nlohmann::ordered_json::array();
  if (!facts.stop_reason.empty()) faults.push_back(facts.stop_reason);
  for (const rt::FaultRule& rule : rt::kFaultTable)
    if (const auto cycles = fault_cycles_[static_cast<size_t>(rule.fault)];
        cycles > 0 && rule.reaction != rt::Reaction::kStop)
      faults.push_back(fmt::format("{} ({} cycles)", rule.words, cycles));

  nlohmann::ordered_json summary;
  summary["robot"] = config_.robot;
  summary["configuration"] = config_.file.string();
  summary["nodes"] = facts.nodes;
  summary["tetrahedra"] = facts.tetrahedra;
  summary["actuators"] = config_.actuators.size();
  summary["effector_dofs"] = effector_coordinates_;
  summary["bus"] = facts.bus;
  summary["control_rate_hz"] = config_.control.rate_hz;
  const double duration_s = 1e-9 * static_cast<double>(running_until_ns_ - running_since_ns_);
  summary["duration_s"] = duration_s;
  summary["cycles"] = counts.cycles;
  summary["late_cycles"] = counts.late_cycles;
  summary["success_rate"] = counts.success_rate();
  summary["model_refreshes"] = facts.model_refreshes;
  summary["model_rate_hz"] =
      facts.model_seconds > 0 ? static_cast<double>(facts.model_refreshes) / facts.model_seconds : 0.0;
  summary["tracking_error_mm"] = statistics(tracking_mm_, true);
  summary["model_error_mm"] = statistics(model_mm_, false);
  summary["qp"] = {
      {"iterations_max", iterations_max_}, {"cap", facts.iteration_cap}, {"statuses", statuses_}};
  summary["rt"] = {{"policy", counts.scheduling.policy},       {"priority", counts.scheduling.priority},
                   {"memory_locked", facts.memory_locked},     {"heap_calls", counts.heap_calls},
                   {"major_faults", counts.page_faults.major}, {"minor_faults", counts.page_faults.minor}};
  summary["wakeup_us"] = microseconds(counts.wakeup);
  summary["cycle_us"] = microseconds(counts.cycle);
  summary["bus_load"] =
      duration_s > 0 ? static_cast<double>(bus_bits_) / duration_s / config_.bus.bitrate : 0.0;
  summary["trace_dropped"] = facts.trace_dropped;
  summary["bus_dropped"] = facts.bus_dropped;
  summary["faults"] = faults;
  std::ofstream out(directory_ / "summary.json");
  out << summary.dump(2) << '\n';
  out.close();
  if (!csv_ || !out)
    throw std::runtime_error(
        fmt::format("{}: the report could not be written in full; is the disk full?", directory_.string()));
}

}  // namespace tendril::app
