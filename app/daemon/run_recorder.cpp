#include "app/daemon/run_recorder.h"

#include <fmt/format.h>
#include <fmt/os.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>

#include "app/robot/robot.h"

namespace tendril::app {
namespace {

// Samples of sensors are at most this old when they arrive, to be held against the model.
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
    : config_(config), directory_(directory), watch_(config) {
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
  place_readings(config);
  write_header();
}

void RunRecorder::place_readings(const Config& config) {
  efforts_.resize(config.actuators.size());
  effort_errors_.resize(config.actuators.size());
  std::size_t signal = 0;
  for (std::size_t s = 0; s < config.sensors.size(); ++s)
    for (const MeasuredConfig& measured : config.sensors[s].measures) {
      const Reading reading{s, signal++};
      if (measured.actuator >= 0)
        efforts_[measured.actuator] = reading;
      else if (measured.effector == 0)
        tip_[measured.axis] = reading;
      else
        others_.push_back({reading, fmt::format("measured_{}_{}_m", config.effectors[measured.effector].name,
                                                "xyz"[measured.axis])});
    }
}

void RunRecorder::write_header() {
  csv_ << "t_s,phase,target_x_m,target_y_m,target_z_m,model_x_m,model_y_m,model_z_m,"
          "measured_x_m,measured_y_m,measured_z_m,measured_t_s";
  for (std::size_t a = 0; a < config_.actuators.size(); ++a) {
    const ActuatorConfig& actuator = config_.actuators[a];
    const char* effort = actuator.is_cavity() ? "Pa" : "N";
    csv_ << fmt::format(",command_{0}_{1},displacement_{0}_{1},effort_{0}_{2}", actuator.name,
                        actuator.is_cavity() ? "m3" : "m", effort);
    if (efforts_[a]) csv_ << fmt::format(",measured_{}_{}", actuator.name, effort);
  }
  for (const OtherReading& other : others_) csv_ << "," << other.column;
  csv_ << ",qp_status,qp_iterations,snapshot_age_s,wakeup_us,cycle_us\n";
}

void RunRecorder::add(const rt::TraceRecord& record, const Motion* motion) {
  if (first_ns_ == 0) first_ns_ = record.intended_ns;
  last_ns_ = record.intended_ns;
  write_row(record, motion);
  watch_.add(record);
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
        {record.intended_ns, Eigen::Map<const Eigen::VectorXd>(record.p_e.data(), effector_coordinates_),
         Eigen::Map<const Eigen::VectorXd>(record.lambda.data(), static_cast<long>(efforts_.size()))});
    while (recent_.front().stamp_ns < record.intended_ns - kMemory_ns) recent_.pop_front();
    if (motion) judge_tip(record, *motion);
    judge_efforts(record);
  }
  known_ns_ = record.sensors.stamp_ns;
}

bool RunRecorder::is_new(const rt::TraceRecord& record, const Reading& reading) const {
  return record.sensors.stamp_ns[reading.sensor] > known_ns_[reading.sensor];
}

std::string RunRecorder::cell(const rt::TraceRecord& record, const std::optional<Reading>& reading,
                              int decimals) const {
  if (!reading || !is_new(record, *reading)) return ",";
  return fmt::format(",{:.{}f}", record.sensors.value[reading->signal], decimals);
}

std::string RunRecorder::tip_cells(const rt::TraceRecord& record) const {
  std::string cells;
  std::int64_t newest_ns = 0;
  for (const auto& reading : tip_) {
    cells += cell(record, reading, 7);
    if (reading && is_new(record, *reading))
      newest_ns = std::max(newest_ns, record.sensors.stamp_ns[reading->sensor]);
  }
  if (newest_ns == 0) return cells + ",";
  return cells + fmt::format(",{:.6f}", 1e-9 * static_cast<double>(newest_ns - first_ns_));
}

void RunRecorder::write_row(const rt::TraceRecord& record, const Motion* motion) {
  const auto seconds = [&](std::int64_t stamp_ns) {
    return 1e-9 * static_cast<double>(stamp_ns - first_ns_);
  };
  std::string row = fmt::format("{:.6f},{}", seconds(record.intended_ns), phase_name(record, motion));
  const bool running = record.phase >= rt::Phase::kRunning;
  row += running ? cells(record.desired.data(), tip_axes_) : ",,,";
  row += running ? cells(record.p_e.data(), tip_axes_) : ",,,";
  row += tip_cells(record);
  for (size_t a = 0; a < config_.actuators.size(); ++a) {
    const bool cavity = config_.actuators[a].is_cavity();  // to 0.1 µm and 1 mm³, to 10 µN and 0.1 Pa
    row += fmt::format(",{0:.{3}f},{1:.{3}f},{2:.{4}f}", record.command[a], record.measured[a],
                       record.lambda[a], cavity ? 11 : 7, cavity ? 2 : 5);
    if (efforts_[a]) row += cell(record, efforts_[a], cavity ? 2 : 5);
  }
  for (const OtherReading& other : others_) row += cell(record, other.reading, 7);
  row +=
      fmt::format(",{},{},{:.6f},{:.2f},{:.2f}\n", record.qp_solved ? qp::name(record.qp_status) : "",
                  record.qp_iterations, 1e-9 * static_cast<double>(record.snapshot_age_ns),
                  1e-3 * static_cast<double>(record.wakeup_ns), 1e-3 * static_cast<double>(record.cycle_ns));
  csv_ << row;
}

const RunRecorder::ModelPoint& RunRecorder::model_at(std::int64_t stamp_ns) const {
  return *std::min_element(recent_.begin(), recent_.end(), [&](const auto& a, const auto& b) {
    return std::abs(a.stamp_ns - stamp_ns) < std::abs(b.stamp_ns - stamp_ns);
  });
}

/// Once every coordinate that is measured is newer than when it was judged last: each at its own instant, as
/// they may come from several sensors.
void RunRecorder::judge_tip(const rt::TraceRecord& record, const Motion& motion) {
  double to_path = 0, to_model = 0;
  bool fresh_news = false;
  std::array<std::int64_t, 3> stamps_ns = judged_ns_;
  for (std::size_t k = 0; k < tip_axes_.size(); ++k) {
    const int axis = tip_axes_[k];
    if (!tip_[axis]) continue;
    const std::int64_t stamp_ns = record.sensors.stamp_ns[tip_[axis]->sensor];
    if (stamp_ns <= judged_ns_[axis] || stamp_ns < motion.path_start_ns()) return;
    stamps_ns[axis] = stamp_ns;
    fresh_news = fresh_news || is_new(record, *tip_[axis]);
    const double measured = record.sensors.value[tip_[axis]->signal];
    const auto row = static_cast<Eigen::Index>(k);
    to_path += std::pow(motion.at(stamp_ns).position[row] - measured, 2);
    to_model += std::pow(model_at(stamp_ns).p_e[row] - measured, 2);
  }
  if (!fresh_news) return;
  judged_ns_ = stamps_ns;
  last_error_mm_ = 1e3 * std::sqrt(to_path);
  tracking_mm_.push_back(*last_error_mm_);
  model_mm_.push_back(1e3 * std::sqrt(to_model));
}

void RunRecorder::judge_efforts(const rt::TraceRecord& record) {
  for (std::size_t a = 0; a < efforts_.size(); ++a) {
    if (!efforts_[a] || !is_new(record, *efforts_[a])) continue;
    const std::int64_t stamp_ns = record.sensors.stamp_ns[efforts_[a]->sensor];
    if (stamp_ns < running_since_ns_) continue;
    const double solved = model_at(stamp_ns).lambda[static_cast<Eigen::Index>(a)];
    effort_errors_[a].push_back(std::abs(record.sensors.value[efforts_[a]->signal] - solved));
  }
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
  summary["effort_error"] = nlohmann::ordered_json::object();
  for (std::size_t a = 0; a < efforts_.size(); ++a)
    if (efforts_[a]) {
      nlohmann::ordered_json& error = summary["effort_error"][config_.actuators[a].name];
      error = statistics(effort_errors_[a], false);
      if (!error.is_null()) error["unit"] = config_.actuators[a].is_cavity() ? "Pa" : "N";
    }
  summary["sensors"] = nlohmann::ordered_json::object();
  for (std::size_t s = 0; s < config_.sensors.size(); ++s) {
    const SensorWatch::Losses& losses = watch_.losses()[s];
    summary["sensors"][config_.sensors[s].frame.name] = {{"losses", losses.count},
                                                         {"stale_s", losses.stale_s()}};
  }
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
