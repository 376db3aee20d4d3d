// SPDX-License-Identifier: Apache-2.0
#include "tools/tendril_latency_run.h"

#include <fmt/format.h>
#include <pthread.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "app/check/private_bus.h"
#include "app/config/master_config.h"
#include "app/daemon/prepared_robot.h"
#include "app/plant/plant.h"
#include "app/program/real_time_rights.h"
#include "app/program/stop_signal.h"
#include "app/robot/control_stack.h"
#include "app/robot/model_thread.h"
#include "app/robot/motion.h"
#include "hal/bus/open_bus.h"
#include "hal/drive/drive_protocol.h"
#include "rt/control_thread.h"
#include "rt/periodic_clock.h"

namespace tendril::tools {
namespace {

constexpr auto kHousekeeping = std::chrono::milliseconds(5);
constexpr double kServingsPerCycle = 2;
constexpr int64_t kProgress_ns = 1'000'000'000;

/// Simulated drives answer for those that are there.
void require_virtual(const std::string& interface) {
  if (!interface.empty() && !std::filesystem::exists("/sys/devices/virtual/net/" + interface))
    throw app::ConfigError(fmt::format(
        "--bus: found '{}', expected a virtual CAN interface such as vcan0 that is there: the drives are "
        "simulated, and would speak for those of a real bus",
        interface));
}

/// The simulated drives, in a thread below the controller's as in tendril-plant. They look at the bus by a
/// clock of their own, so that the cycle does not pay for waking them: on a robot, drives are other
/// computers.
class DriveThread {
 public:
  DriveThread(const app::Config& config, const LatencyOptions& options)
      : bus_name_(options.bus.empty() ? medium_.emplace().name() : options.bus),
        drives_(config),
        bus_(hal::open_bus(bus_name_, hal::BusRole::kHost)),
        clock_(std::min(kServingsPerCycle * options.rate_hz, rt::DeadlineGrid::kHighestRateHz)),
        thread_({"drives", std::max(1, options.priority / 2), options.housekeeping_cpu},
                rt::RtRights::kIgnore, [this] { serve(); }) {}
  ~DriveThread() { quit_ = true; }  // the thread is joined next

  const std::string& bus() const { return bus_name_; }

 private:
  void serve() noexcept {
    while (!quit_) {
      clock_.wait();
      const app::PlantMeasurement nothing{.stamp_ns = rt::now_ns()};  // but sensors tell even that
      drives_.serve(*bus_, nothing, nothing.stamp_ns);
      clock_.realign(rt::now_ns());
    }
  }

  std::optional<app::PrivateBus> medium_;
  std::string bus_name_;
  app::PlantDrives drives_;
  std::unique_ptr<hal::Bus> bus_;
  rt::PeriodicClock clock_;
  std::atomic<bool> quit_{false};
  rt::RealtimeThread thread_;  // last: it uses all others
};

/// Drains the trace of a control thread until it has ended, and ends it when time is up or a signal comes.
class Watch {
 public:
  using EachRound = std::function<void()>;

  Watch(rt::Channels& channels, const LatencyOptions& options, LatencyStages& stages,
        const TellProgress& tell)
      : channels_(channels), options_(options), stages_(stages), tell_(tell) {}

  /// @param each_round  called each round
  /// @return  seconds measured
  double run(const EachRound& each_round) {
    bool ended = false;
    while (!ended) {
      ended = channels_.progress.ended.load(std::memory_order_acquire);  // before the last draining
      each_round();
      drain();
      const bool time_is_up = options_.duration_s > 0 && first_ns_ > 0 && seconds() >= options_.duration_s;
      if (time_is_up || app::stop_signalled()) channels_.requests.stop = true;
      if (first_ns_ > 0 && last_ns_ >= progress_due_ns_) {
        progress_due_ns_ = last_ns_ + kProgress_ns;
        tell_(seconds());
      }
      if (!ended) std::this_thread::sleep_for(kHousekeeping);
    }
    return seconds();
  }

 private:
  double seconds() const { return 1e-9 * static_cast<double>(last_ns_ - first_ns_); }

  void drain() {
    rt::TraceRecord record;
    while (channels_.trace.pop(record)) {
      if (record.phase != rt::Phase::kRunning) continue;
      last_ns_ = record.intended_ns;
      if (first_ns_ == 0) {
        first_ns_ = last_ns_;
        progress_due_ns_ = first_ns_ + kProgress_ns;
      }
      stages_.add(record);
    }
  }

  rt::Channels& channels_;
  const LatencyOptions& options_;
  LatencyStages& stages_;
  const TellProgress& tell_;
  int64_t first_ns_ = 0, last_ns_ = 0, progress_due_ns_ = 0;
};

struct StopAtExit {
  rt::Requests& requests;
  ~StopAtExit() { requests.stop = true; }
};

std::string words_of(const rt::Scheduling& scheduling) {
  return fmt::format("{} {}", scheduling.policy, scheduling.priority);
}

/// The control loop's way of waiting and nothing else.
/// Real-time: the thread that is measured.
void run_bare_timer(rt::PeriodicClock& clock, rt::Channels& channels) noexcept {
  rt::TraceRecord record;
  record.phase = rt::Phase::kRunning;
  while (!channels.requests.stop.load(std::memory_order_relaxed)) {
    record.intended_ns = clock.wait();
    const int64_t woken_ns = rt::now_ns();
    record.wakeup_ns = woken_ns - record.intended_ns;
    record.missed = clock.realign(woken_ns);
    channels.trace.push(record);
  }
  channels.progress.ended.store(true, std::memory_order_release);
}

}  // namespace

LatencyFacts run_robot(app::Config config, const LatencyOptions& options, LatencyStages& stages,
                       const TellProgress& tell) {
  require_virtual(options.bus);
  config.control.rate_hz = options.rate_hz;
  config.control.model_cpu = options.model_cpu;
  config.control.model_rate_limit_hz = options.model_rate_limit;
  config.control.late_cycles_limit = std::numeric_limits<int>::max();
  config = app::with_drives_only(config);
  // Where this machine stalls the simulated drives, they lag behind.
  for (app::ActuatorConfig& actuator : config.actuators)
    if (!actuator.follows_effort()) actuator.drive.following_error = 1;
  LatencyFacts facts;
  const app::PreparedRobot prepared = app::prepare_robot(config, options.allow_non_rt);
  facts.memory_locked = prepared.memory_locked;
  facts.idle_latency_held = prepared.idle_latency_limit != nullptr;

  const DriveThread drives(config, options);
  auto master = hal::make_master(app::master_config(config));
  const auto bus = hal::open_bus(drives.bus(), hal::BusRole::kJoin, master->identifiers());
  app::ControlStack stack(prepared.law, std::move(master), *bus);
  rt::Channels& channels = *stack.channels;
  app::ModelThread model(*prepared.robot, config, channels);
  rt::ControlThread control({"control", options.priority, options.cpu}, app::rights_of(options.allow_non_rt),
                            options.rate_hz, stack.loop, channels);
  if (!control.refusal().empty()) spdlog::warn("{}", control.refusal());
  rt::keep_to_cpu(pthread_self(), "main", options.housekeeping_cpu);

  std::optional<app::Motion> motion;
  facts.seconds = Watch(channels, options, stages, tell).run([&] {
    if (config.motion && channels.run_starts.fresh())
      motion.emplace(config, prepared.rest, channels.run_starts.latest());
    if (!motion) return;
    channels.targets.back() = motion->at(rt::now_ns());
    channels.targets.publish();
  });
  control.join();
  model.stop();
  const rt::LoopCounts& counts = control.counts();
  facts.scheduling = words_of(counts.scheduling);
  facts.trace_dropped = channels.trace.dropped();
  if (counts.heap_calls >= 0) facts.heap_calls = counts.heap_calls;
  facts.page_faults = counts.page_faults.total();
  facts.model_rate_hz = model.mean_rate_hz();
  if (const std::string reason = stack.stop_reason(config); !reason.empty())
    facts.problems.push_back("the controller stopped: " + reason);
  return facts;
}

LatencyFacts run_timer(const LatencyOptions& options, LatencyStages& stages, const TellProgress& tell) {
  LatencyFacts facts;
  facts.memory_locked = app::lock_memory(options.allow_non_rt);
  const auto idle_latency_limit = app::limit_idle_latency(0);
  facts.idle_latency_held = idle_latency_limit != nullptr;
  const auto channels = std::make_unique<rt::Channels>();
  rt::Scheduling scheduling;
  rt::RealtimeThread timer({"timer", options.priority, options.cpu}, app::rights_of(options.allow_non_rt),
                           [&] {
                             scheduling = rt::scheduling_of_this_thread();
                             rt::PeriodicClock clock(options.rate_hz);
                             run_bare_timer(clock, *channels);
                           });
  const StopAtExit stop_at_exit{channels->requests};
  if (!timer.refusal().empty()) spdlog::warn("{}", timer.refusal());
  rt::keep_to_cpu(pthread_self(), "main", options.housekeeping_cpu);
  facts.seconds = Watch(*channels, options, stages, tell).run([] {});
  timer.join();
  facts.scheduling = words_of(scheduling);
  facts.trace_dropped = channels->trace.dropped();
  return facts;
}

}  // namespace tendril::tools
