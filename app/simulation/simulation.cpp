// SPDX-License-Identifier: Apache-2.0
#include "app/simulation/simulation.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "app/daemon/run_recorder.h"
#include "app/program/exit_codes.h"
#include "app/program/report_pictures.h"
#include "app/program/stop_signal.h"
#include "app/robot/robot_geometry.h"
#include "app/virtual_time/virtual_rig.h"

namespace tendril::app {
namespace {

constexpr double kStartWithin_s = 60;  // of virtual time, until the drives follow
constexpr double kStopWithin_s = 60;
constexpr double kStep_s = 0.1;  // of virtual time between looks at what has happened

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// A run and what is kept of it, step by step: the rig keeps everything until it is told to forget.
class Run {
 public:
  Run(const Config& config, const SimulationOptions& options)
      : config_(config), rig_(config, settings_of(options)), axes_(tip_axes(config)) {
    if (!options.report.empty()) recorder_.emplace(config, options.report);
    rig_.observe_snapshots([this](const rt::Snapshot&) { ++refreshes_; });
  }

  /// Lets virtual time pass, at most until a phase.
  void go(double seconds, rt::Phase until) {
    rig_.run_until(until, seconds);
    for (const rt::TraceRecord& record : rig_.trace()) {
      if (recorder_) recorder_->add(record, rig_.motion() ? &*rig_.motion() : nullptr);
      counts_.cycles += 1 + record.missed;
      counts_.late_cycles += record.missed;
    }
    for (const PlantMeasurement& seen : rig_.measurements()) add_error(seen);
    phase_ = rig_.phase();
    rig_.forget_trace();
  }

  rt::Phase phase() const { return phase_; }
  void stop() { rig_.requests().stop = true; }
  std::string stop_reason() const { return rig_.stop_reason(); }

  void print(double running_s, double took_s) const {
    const std::string error = samples_ > 0 ? fmt::format("{:.2f} mm", 1e3 * last_error_) : "-";
    fmt::print("{:5.0f} s  {:8}  error {:>8}  {:.1f} times real time\n", running_s, rt::name(phase_), error,
               took_s > 0 ? running_s / took_s : 0);
    std::fflush(stdout);
  }

  std::string verdict() const {
    if (samples_ == 0) return "there is no path to be on";
    return fmt::format("the tip was {:.2f} mm from its path in the mean, {:.2f} mm at most",
                       1e3 * error_sum_ / static_cast<double>(samples_), 1e3 * largest_error_);
  }

  /// @throws std::runtime_error where the report cannot be written
  void finish(const SimulationOptions& options) {
    if (!recorder_) return;
    const rt::ControllerConfig law = controller_config(config_);
    recorder_->finish({.nodes = rig_.mesh().node_count(),
                       .tetrahedra = rig_.mesh().tet_count(),
                       .bus = "virtual time",
                       .iteration_cap = law.iteration_cap,
                       .model_refreshes = refreshes_,
                       .model_rate_hz = options.model_rate_hz,
                       .stop_reason = stop_reason()},
                      counts_);
    recorder_->add_geometry(robot_geometry(config_, rig_.mesh()));
    draw_report(options.report);
  }

 private:
  static VirtualSettings settings_of(const SimulationOptions& options) {
    VirtualSettings settings;
    settings.model_rate_hz = options.model_rate_hz;
    return settings;
  }

  void add_error(const PlantMeasurement& seen) {
    if (std::exchange(seen_ns_, seen.stamp_ns) == seen.stamp_ns) return;  // the last one stays
    if (!rig_.motion() || seen.stamp_ns < rig_.motion()->path_start_ns() ||
        rig_.phase() > rt::Phase::kRunning)
      return;
    const rt::EffectorVector wanted = rig_.motion()->at(seen.stamp_ns).position;
    double sum = 0;
    for (std::size_t k = 0; k < axes_.size(); ++k)
      sum += std::pow(seen.tip[axes_[k]] - wanted[static_cast<Eigen::Index>(k)], 2);
    last_error_ = std::sqrt(sum);
    error_sum_ += last_error_;
    largest_error_ = std::max(largest_error_, last_error_);
    ++samples_;
  }

  const Config& config_;
  VirtualRig rig_;
  std::vector<int> axes_;  // of the tip, whose true position the simulated body knows
  std::optional<RunRecorder> recorder_;
  rt::Phase phase_ = rt::Phase::kConnecting;
  rt::LoopCounts counts_;
  uint64_t refreshes_ = 0;
  double last_error_ = 0, error_sum_ = 0, largest_error_ = 0;  // m, of the true tip on its path
  int64_t samples_ = 0, seen_ns_ = 0;
};

}  // namespace

int simulate(const Config& config, const SimulationOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  Run run(config, options);
  run.go(kStartWithin_s, rt::Phase::kRunning);
  double running_s = 0;
  for (int step = 1;
       run.phase() == rt::Phase::kRunning && running_s < options.duration_s && !stop_signalled(); ++step) {
    const double next_s = std::min(step * kStep_s, options.duration_s);
    run.go(next_s - running_s, rt::Phase::kStopping);
    running_s = next_s;
    if (step % 10 == 0) run.print(running_s, seconds_since(begin));
  }
  run.stop();
  run.go(kStopWithin_s, rt::Phase::kStopped);
  run.finish(options);
  const std::string reason = run.stop_reason();
  if (!reason.empty()) spdlog::error("stopped: {}", reason);
  spdlog::info("{} for {:.1f} s in virtual time, {:.1f} s of ours: {}", config.robot, running_s,
               seconds_since(begin), run.verdict());
  return reason.empty() ? kOk : kCheckFailed;
}

}  // namespace tendril::app
