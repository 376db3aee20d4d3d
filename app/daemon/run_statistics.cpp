// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/run_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "app/config/master_config.h"
#include "hal/drive/following_monitor.h"

namespace tendril::app {
namespace {

// A model that was further from its target than this is worth a warning.
constexpr double kOffTarget = 1e-3;  // m

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
      errors_(config),
      watch_(config),
      effort_errors_(config.actuators.size()),
      following_errors_(config.actuators.size()) {
  const auto rows = effector_rows(config);
  effector_coordinates_ = static_cast<int>(rows.size());
  const int moving = config.motion ? config.motion->effector : 0;
  for (int r = 0; r < effector_coordinates_; ++r) {
    const EffectorRow& row = rows[static_cast<std::size_t>(r)];
    if (row.effector == moving && row.weight > 0 && row.is_position()) moving_rows_.push_back(r);
  }
}

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
    add_target_to_model(record, motion);
    for (std::size_t a = 0; a < following_errors_.size(); ++a)
      following_errors_[a] = std::max(following_errors_[a], std::abs(record.command[a] - record.measured[a]));
  }
  errors_.add(record, motion);
  if (errors_.tip()) {
    last_error_mm_ = 1e3 * errors_.tip()->to_path;
    tracking_mm_.push_back(*last_error_mm_);
    model_mm_.push_back(1e3 * errors_.tip()->to_model);
  }
  for (const SampleErrors::Effort& effort : errors_.efforts())
    effort_errors_[effort.actuator].push_back(effort.error);
}

void RunStatistics::add_target_to_model(const rt::TraceRecord& record, const Motion* motion) {
  if (motion && record.intended_ns < motion->path_start_ns()) return;
  rt::EffectorVector wanted =
      Eigen::Map<const rt::EffectorVector>(record.desired.data(), effector_coordinates_);
  if (motion) wanted = motion->at(record.intended_ns).position;
  double sum = 0;
  for (const int r : moving_rows_) sum += std::pow(wanted[r] - record.p_e[static_cast<std::size_t>(r)], 2);
  const double error = std::sqrt(sum);
  ++target_to_model_.samples;
  target_to_model_.sum += error;
  if (error <= target_to_model_.max) return;
  target_to_model_.max = error;
  target_to_model_.max_at_s = 1e-9 * static_cast<double>(record.intended_ns - running_since_ns_);
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

nlohmann::json RunStatistics::target_to_model_mm() const {
  const TargetToModel& error = target_to_model_;
  if (error.samples == 0) return nullptr;
  return {{"mean", 1e3 * error.sum / static_cast<double>(error.samples)},
          {"max", 1e3 * error.max},
          {"max_at_s", error.max_at_s},
          {"samples", error.samples}};
}

nlohmann::ordered_json RunStatistics::effort_error() const {
  auto result = nlohmann::ordered_json::object();
  for (std::size_t a = 0; a < effort_errors_.size(); ++a) {
    if (!errors_.signals().efforts[a]) continue;
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
  if (target_to_model_.max > kOffTarget)
    result.push_back(fmt::format(
        "the model was up to {:.2f} mm from the target, at {:.2f} s: the target was too fast or out of "
        "reach, see tendrild --check",
        1e3 * target_to_model_.max, target_to_model_.max_at_s));
  return result;
}

}  // namespace tendril::app
