#include "app/daemon/run_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "app/config/master_config.h"
#include "app/robot/robot.h"
#include "hal/drive/following_monitor.h"

namespace tendril::app {
namespace {

// Samples of sensors that are older than this when they arrive are not compared with the model.
constexpr int64_t kMemory_ns = 1'000'000'000;

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

}  // namespace

RunStatistics::RunStatistics(const Config& config)
    : config_(config),
      signals_(config),
      watch_(config),
      effector_coordinates_(static_cast<int>(effector_rows(config).size())),
      effort_errors_(config.actuators.size()),
      following_errors_(config.actuators.size()) {}

void RunStatistics::add(const rt::TraceRecord& record, const Motion* motion) {
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
    recent_.push_back({record.intended_ns,
                       Eigen::Map<const Eigen::VectorXd>(record.desired.data(), effector_coordinates_),
                       Eigen::Map<const Eigen::VectorXd>(record.p_e.data(), effector_coordinates_),
                       Eigen::Map<const Eigen::VectorXd>(record.lambda.data(),
                                                         static_cast<Eigen::Index>(effort_errors_.size()))});
    while (recent_.front().stamp_ns < record.intended_ns - kMemory_ns) recent_.pop_front();
    add_tip_error(record, motion);
    add_effort_errors(record);
    for (std::size_t a = 0; a < following_errors_.size(); ++a)
      following_errors_[a] = std::max(following_errors_[a], std::abs(record.command[a] - record.measured[a]));
  }
  new_samples_.pass(record);
}

const RunStatistics::ModelPoint& RunStatistics::model_at(int64_t stamp_ns) const {
  return *std::min_element(recent_.begin(), recent_.end(), [&](const auto& a, const auto& b) {
    return std::abs(a.stamp_ns - stamp_ns) < std::abs(b.stamp_ns - stamp_ns);
  });
}

/// Once every coordinate that is measured is newer than when it counted last: each at its own instant, as
/// they may come from several sensors.
void RunStatistics::add_tip_error(const rt::TraceRecord& record, const Motion* motion) {
  const int64_t since_ns = motion ? motion->path_start_ns() : running_since_ns_;
  double to_path = 0, to_model = 0;
  bool any_new = false;
  std::array<int64_t, 3> stamps_ns = compared_ns_;
  for (std::size_t k = 0; k < signals_.tip_axes.size(); ++k) {
    const int axis = signals_.tip_axes[k];
    const auto& index = signals_.tip[axis];
    if (!index || config_.effectors[0].weights[k] <= 0) continue;
    const int64_t stamp_ns = record.sensors.stamp_ns[index->sensor];
    if (stamp_ns <= compared_ns_[axis] || stamp_ns < since_ns) return;
    stamps_ns[axis] = stamp_ns;
    any_new = any_new || new_samples_.has(record, *index);
    const double measured = record.sensors.value[index->signal];
    const auto row = static_cast<Eigen::Index>(k);
    const ModelPoint& model = model_at(stamp_ns);
    to_path += std::pow((motion ? motion->at(stamp_ns).position : model.desired)[row] - measured, 2);
    to_model += std::pow(model.p_e[row] - measured, 2);
  }
  if (!any_new) return;
  compared_ns_ = stamps_ns;
  last_error_mm_ = 1e3 * std::sqrt(to_path);
  tracking_mm_.push_back(*last_error_mm_);
  model_mm_.push_back(1e3 * std::sqrt(to_model));
}

void RunStatistics::add_effort_errors(const rt::TraceRecord& record) {
  for (std::size_t a = 0; a < effort_errors_.size(); ++a) {
    const auto& index = signals_.efforts[a];
    if (!index || !new_samples_.has(record, *index)) continue;
    const int64_t stamp_ns = record.sensors.stamp_ns[index->sensor];
    if (stamp_ns < running_since_ns_) continue;
    const double solved = model_at(stamp_ns).lambda[static_cast<Eigen::Index>(a)];
    effort_errors_[a].push_back(std::abs(record.sensors.value[index->signal] - solved));
  }
}

double RunStatistics::running_s() const {
  return 1e-9 * static_cast<double>(running_until_ns_ - running_since_ns_);
}

double RunStatistics::bus_load() const {
  const double seconds = running_s();
  return seconds > 0 ? static_cast<double>(bus_bits_) / seconds / config_.bus.bitrate : 0.0;
}

nlohmann::json RunStatistics::tracking_error_mm() const { return statistics(tracking_mm_, true); }

nlohmann::json RunStatistics::model_error_mm() const { return statistics(model_mm_, false); }

nlohmann::ordered_json RunStatistics::effort_error() const {
  auto result = nlohmann::ordered_json::object();
  for (std::size_t a = 0; a < effort_errors_.size(); ++a) {
    if (!signals_.efforts[a]) continue;
    nlohmann::ordered_json& error = result[config_.actuators[a].name];
    error = statistics(effort_errors_[a], false);
    if (!error.is_null()) error["unit"] = config_.actuators[a].is_cavity() ? "Pa" : "N";
  }
  return result;
}

nlohmann::ordered_json RunStatistics::following_error() const {
  auto result = nlohmann::ordered_json::object();
  const hal::MasterConfig drives = master_config(config_);
  for (std::size_t a = 0; a < following_errors_.size(); ++a) {
    const ActuatorConfig& actuator = config_.actuators[a];
    if (actuator.follows_effort()) continue;
    const hal::DisplacementUnit unit = displacement_unit(actuator);
    result[actuator.name] = {{"max", unit.per_si * following_errors_[a]},
                             {"limit", unit.per_si * hal::following_error_limit(drives.axes[a])},
                             {"unit", unit.name}};
  }
  return result;
}

nlohmann::ordered_json RunStatistics::sensors() const {
  auto result = nlohmann::ordered_json::object();
  for (std::size_t s = 0; s < config_.sensors.size(); ++s) {
    const SensorWatch::Losses& losses = watch_.losses()[s];
    result[config_.sensors[s].frame.name] = {{"losses", losses.count}, {"stale_s", losses.stale_s()}};
  }
  return result;
}

nlohmann::ordered_json RunStatistics::qp() const {
  return {{"iterations_max", iterations_max_}, {"statuses", statuses_}};
}

std::vector<std::string> RunStatistics::warnings() const {
  std::vector<std::string> result;
  for (const rt::FaultRule& rule : rt::kFaultTable)
    if (const auto cycles = fault_cycles_[static_cast<size_t>(rule.fault)];
        cycles > 0 && rule.reaction != rt::Reaction::kStop)
      result.push_back(fmt::format("{} ({} cycles)", rule.words, cycles));
  return result;
}

}  // namespace tendril::app
