// SPDX-License-Identifier: Apache-2.0
#include "app/check/path_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <string_view>

#include "app/virtual_time/virtual_rig.h"

namespace tendril::app {
namespace {

constexpr double kStartWithin_s = 60;  // of virtual time, until the drives follow
constexpr double kStep_s = 0.1;        // of virtual time between looks at what has happened
constexpr double kModelRate_hz = 60;
constexpr double kTimeStep_s = 0.02;  // of the body's integrator
constexpr double kSpeedWindow_s = 0.02;
// A limit that was met no longer ago may be what keeps the model from its path now.
constexpr int64_t kJustNow_ns = 100'000'000;
// Shorter times at the top speed are corners of the path.
constexpr double kNotable_s = 0.05;
// Top speeds are raised so far to see what the path asks.
constexpr double kRaised = 20;

/// The same robot, its simulated body the controller's own model.
Config twin_of_model(Config config, double model_rate_hz) {
  PlantConfig twin;
  twin.young_modulus = config.material.material.young_modulus;
  twin.poisson_ratio = config.material.material.poisson_ratio;
  twin.mass = config.material.mass;
  twin.damping_mass = 2;
  twin.damping_stiffness = 0.01;
  twin.time_step = std::clamp(1 / model_rate_hz, kTimeStep_s, 0.1);
  if (config.plant) twin.drives = config.plant->drives;
  twin.drives.left_enabled = false;
  config.plant = twin;
  return config;
}

/// As often as the daemon could, but no more than needed; in few steps, so that small differences between
/// machines do not show.
double model_rate_hz(const Config& config, double refresh_s) {
  double rate = kModelRate_hz;
  while (rate * refresh_s > 1 && rate > 2 / config.control.snapshot_age_limit) rate /= 2;
  const double limit = config.control.model_rate_limit_hz;
  return limit > 0 ? std::min(limit, rate) : rate;
}

/// Reads the trace of a run on the path.
class PathObserver {
 public:
  PathObserver(const Config& config, PathCheck& result)
      : config_(config),
        result_(result),
        law_(controller_config(config)),
        window_(std::max<std::size_t>(1, std::lround(kSpeedWindow_s * config.control.rate_hz))) {
    result_.actuators.resize(config.actuators.size());
    const auto rows = effector_rows(config);
    for (std::size_t r = 0; r < rows.size(); ++r)
      if (rows[r].effector == config.motion->effector && rows[r].weight > 0) rows_.push_back(r);
  }

  void add(const rt::TraceRecord& record, const Motion& motion) {
    const PathInstant now{1e-9 * static_cast<double>(record.intended_ns - motion.path_start_ns()),
                          motion.part(record.intended_ns)};
    add_speeds(record, now);
    add_faults(record, now);
    add_error(record, now, motion.at(record.intended_ns).position);
  }

 private:
  struct Met {
    AtLimit limit;
    int64_t stamp_ns;
  };

  void add_speeds(const rt::TraceRecord& record, const PathInstant& now) {
    commands_.push_back(record.command);
    if (commands_.size() > window_ + 1) commands_.pop_front();
    if (commands_.size() < 2) return;
    const auto& before = commands_[commands_.size() - 2];
    const double window_s = static_cast<double>(commands_.size() - 1) * law_.period_s;
    for (std::size_t a = 0; a < result_.actuators.size(); ++a) {
      ActuatorDemand& demand = result_.actuators[a];
      const double top = config_.actuators[a].top_rate;
      if (commands_.size() == window_ + 1)
        demand.top_speed =
            std::max(demand.top_speed, std::abs(record.command[a] - commands_.front()[a]) / window_s);
      if (std::abs(record.command[a] - before[a]) < (1 - 1e-6) * top * law_.period_s) continue;
      demand.at_top_speed_s += law_.period_s;
      if (!demand.first) demand.first = now;
      const bool cavity = config_.actuators[a].is_cavity();
      note({config_.actuators[a].name, cavity ? "top_flow" : "top_speed", true, (cavity ? 1e6 : 1e3) * top,
            cavity ? "ml/s" : "mm/s"},
           record.intended_ns);
    }
  }

  void add_faults(const rt::TraceRecord& record, const PathInstant& now) {
    for (const rt::FaultRule& rule : rt::kFaultTable) {
      if (!record.faults.has(rule.fault) || rule.reaction == rt::Reaction::kStop) continue;
      auto found = std::ranges::find(result_.faults, rule.fault, &PathFault::fault);
      if (found == result_.faults.end()) found = result_.faults.insert(found, {rule.fault, 0, now});
      ++found->cycles;
    }
  }

  void add_error(const rt::TraceRecord& record, const PathInstant& now, const rt::EffectorVector& wanted) {
    double sum = 0;
    for (const std::size_t r : rows_)
      sum += std::pow(wanted[static_cast<Eigen::Index>(r)] - record.p_e[r], 2);
    const double error = std::sqrt(sum);
    const auto m = static_cast<Eigen::Index>(result_.actuators.size());
    for (const AtLimit& at : limits_met(config_, Eigen::Map<const Eigen::VectorXd>(record.lambda.data(), m),
                                        Eigen::Map<const Eigen::VectorXd>(record.command.data(), m)))
      note(at, record.intended_ns);
    if (now.time_s < 0) {
      result_.approach_error_max = std::max(result_.approach_error_max, error);
      return;
    }
    error_sum_ += error;
    result_.error_mean = error_sum_ / ++samples_;
    if (error > kReached && !result_.first_off) result_.first_off = now;
    if (error <= result_.error_max) return;
    result_.error_max = error;
    result_.worst = now;
    result_.at_limits.clear();
    for (const Met& met : met_)
      if (met.stamp_ns >= record.intended_ns - kJustNow_ns) result_.at_limits.push_back(met.limit);
  }

  void note(const AtLimit& at, int64_t stamp_ns) {
    const auto same = [&](const Met& met) {
      return met.limit.actuator == at.actuator && std::string_view(met.limit.quantity) == at.quantity &&
             met.limit.greatest == at.greatest;
    };
    const auto found = std::ranges::find_if(met_, same);
    if (found == met_.end())
      met_.push_back({at, stamp_ns});
    else
      found->stamp_ns = stamp_ns;
  }

  const Config& config_;
  PathCheck& result_;
  rt::ControllerConfig law_;
  std::size_t window_;             // cycles
  std::vector<std::size_t> rows_;  // of the effector that moves
  std::deque<std::array<double, kMaxActuators>> commands_;
  std::vector<Met> met_;
  double error_sum_ = 0, samples_ = 0;
};

PathCheck simulate_path(const Config& config, double model_rate_hz,
                        const std::function<void(double)>& progress) {
  PathCheck result;
  result.model_rate_hz = model_rate_hz;
  VirtualSettings settings;
  settings.model_rate_hz = model_rate_hz;
  VirtualRig rig(config, settings);
  if (!rig.run_until(rt::Phase::kRunning, kStartWithin_s) || !rig.motion()) {
    result.stop_reason = rig.stop_reason();
    if (result.stop_reason.empty())
      result.stop_reason =
          fmt::format("the simulated drives do not follow within {:g} s of virtual time", kStartWithin_s);
    return result;
  }
  result.started = true;
  const int64_t begin_ns = rig.now_ns(), path_ns = rig.motion()->path_start_ns();
  result.approach_s = 1e-9 * static_cast<double>(path_ns - begin_ns);
  result.round_s = 1e-9 * static_cast<double>(rig.motion()->round_ns());
  const bool goes_on = config.motion->closed && !config.motion->turns && result.round_s > 0;
  const double wanted_s = goes_on ? std::max(result.round_s, kLeastOfPath_s) : result.round_s;
  const int64_t end_ns =
      std::min(path_ns + std::llround(1e9 * wanted_s), begin_ns + std::llround(1e9 * kSimulatedPath_s));
  PathObserver observer(config, result);
  int64_t seen_ns = begin_ns;
  rig.forget_trace();
  while (seen_ns < end_ns && rig.phase() == rt::Phase::kRunning) {
    rig.run_until(rt::Phase::kStopping, kStep_s);
    for (const rt::TraceRecord& record : rig.trace()) {
      if (record.intended_ns > end_ns || record.phase != rt::Phase::kRunning) break;
      observer.add(record, *rig.motion());
      seen_ns = record.intended_ns;
    }
    if (!rig.trace().empty() && rig.trace().back().intended_ns > end_ns) seen_ns = end_ns;
    rig.forget_trace();
    progress(static_cast<double>(seen_ns - begin_ns) / static_cast<double>(end_ns - begin_ns));
  }
  result.covered_s = 1e-9 * static_cast<double>(std::max<int64_t>(0, seen_ns - path_ns));
  result.stop_reason = rig.stop_reason();
  return result;
}

}  // namespace

PathCheck check_path(const Config& config, double refresh_s, const std::function<void(double)>& progress) {
  const double rate_hz = model_rate_hz(config, refresh_s);
  Config twin = twin_of_model(config, rate_hz);
  PathCheck result = simulate_path(twin, rate_hz, progress);
  const auto notable = [](const ActuatorDemand& demand) { return demand.at_top_speed_s > kNotable_s; };
  if (std::ranges::none_of(result.actuators, notable)) return result;
  for (ActuatorConfig& actuator : twin.actuators) actuator.top_rate *= kRaised;
  const PathCheck free = simulate_path(twin, rate_hz, progress);
  if (!free.stop_reason.empty()) return result;
  for (std::size_t a = 0; a < result.actuators.size(); ++a)
    if (notable(result.actuators[a])) result.actuators[a].asked_speed = free.actuators[a].top_speed;
  return result;
}

}  // namespace tendril::app
