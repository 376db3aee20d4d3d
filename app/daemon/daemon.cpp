#include "app/daemon/daemon.h"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <thread>

#include "app/config/master_config.h"
#include "app/daemon/run_recorder.h"
#include "app/daemon/sensor_watch.h"
#include "app/daemon/service_manager.h"
#include "app/program/real_time_rights.h"
#include "app/program/report_pictures.h"
#include "app/program/stop_signal.h"
#include "app/robot/bus_check.h"
#include "app/robot/channels.h"
#include "app/robot/inverse_statics.h"
#include "app/robot/model_thread.h"
#include "app/robot/motion.h"
#include "app/robot/qp_budget.h"
#include "app/robot/robot.h"
#include "hal/bus/open_bus.h"
#include "hal/drive/drive_protocol.h"
#include "rt/periodic_clock.h"

namespace tendril::app {
namespace {

constexpr auto kHousekeeping = std::chrono::milliseconds(5);
constexpr std::int64_t kProgress_ns = 1'000'000'000;

struct StopAtExit {
  rt::Requests& requests;
  ~StopAtExit() { requests.stop = true; }
};

/// What the main thread does while the control thread runs: drains the trace, feeds targets, tells a person
/// and the service manager how it goes.
class Housekeeping {
 public:
  Housekeeping(const Config& config, const DaemonOptions& options, Channels& channels,
               const ModelThread& model, const hal::DriveMaster& master, rt::EffectorVector rest,
               RunRecorder* recorder, ServiceManager& service)
      : config_(config),
        options_(options),
        channels_(channels),
        model_(model),
        master_(master),
        introduced_(config.actuators.size(), false),
        rest_(std::move(rest)),
        recorder_(recorder),
        service_(service),
        watch_(config) {}

  /// One round. What the control thread waits for comes first, what may take its time last.
  void tend() {
    const std::int64_t now_ns = rt::now_ns();
    if (motion_) {
      channels_.targets.back() = motion_->at(now_ns);
      channels_.targets.publish();
    }
    const bool time_is_up = options_.duration_s > 0 && running_since_ns_ > 0 &&
                            1e-9 * static_cast<double>(now_ns - running_since_ns_) > options_.duration_s;
    if (stop_signalled() || time_is_up) channels_.requests.stop = true;
    drain();
    introduce_drives();
    service_.feed_watchdog(now_ns, last_.cycles);
    if (now_ns - told_ns_ >= kProgress_ns) {
      tell_status(now_ns);
      tell_stalls();
    }
    if (now_ns >= next_progress_ns_) show_progress(now_ns);
  }

  /// Takes what is left in the ring.
  void drain() {
    rt::TraceRecord record;
    while (channels_.trace.pop(record)) {
      if (record.phase != last_.phase) announce(record);
      if (record.faults.bits() != last_.faults.bits()) tell_faults(record.faults, record.intended_ns);
      for (const SensorWatch::Change& change : watch_.add(record)) tell(change);
      if (record.page_faults != last_.page_faults || record.heap_calls != last_.heap_calls)
        stalls_untold_ = true;
      bus_bits_ += record.bus_bits;
      if (recorder_) recorder_->add(record, motion_ ? &*motion_ : nullptr);
      last_ = record;
    }
  }

 private:
  /// Tells which drives have answered, each once.
  void introduce_drives() {
    for (std::size_t i = 0; i < introduced_.size(); ++i) {
      if (introduced_[i]) continue;
      const std::string identity = master_.identity(static_cast<int>(i));
      if (identity.empty()) continue;
      introduced_[i] = true;
      spdlog::info("{}", identity);
    }
  }

  /// Tells of a change in what is wrong, at most once in a while.
  void tell_faults(rt::FaultSet faults, std::int64_t now_ns) {
    if (now_ns < next_tale_ns_) return;
    next_tale_ns_ = now_ns + kProgress_ns;
    for (const rt::FaultRule& rule : rt::kFaultTable)
      if (faults.has(rule.fault)) spdlog::warn("{}", rule.words);
    if (faults.bits() == 0) spdlog::info("no fault any more");
  }

  void tell(const SensorWatch::Change& change) {
    const hal::SensorConfig& sensor = config_.sensors[change.sensor].frame;
    if (change.lost)
      spdlog::warn("{}", loss(sensor));
    else
      spdlog::info("sensor '{}' is back after {:.3g} s", sensor.name, change.stale_s);
  }

  void announce(const rt::TraceRecord& record) {
    spdlog::info("phase: {}", rt::name(record.phase));
    if (record.phase == rt::Phase::kRunning) {
      running_since_ns_ = record.intended_ns;
      if (config_.motion) motion_.emplace(config_, rest_, record);
      service_.ready();
    }
    if (record.phase >= rt::Phase::kStopping && last_.phase < rt::Phase::kStopping) service_.stopping();
  }

  /// Of all deadlines so far.
  double on_time_percent() const {
    const auto deadlines = static_cast<double>(std::max<std::int64_t>(last_.cycles, 1));
    return 100 * (1 - static_cast<double>(last_.late_cycles) / deadlines);
  }

  /// Rates are those since the last status: what stands still shows.
  void tell_status(std::int64_t now_ns) {
    const double elapsed_s = 1e-9 * static_cast<double>(now_ns - told_ns_);
    const std::uint64_t refreshes = model_.refreshes();
    const std::int64_t worked_off = last_.cycles - last_.late_cycles;
    std::string line = worked_off == told_cycles_
                           ? "the control thread stands still"
                           : fmt::format("{}, {:.0f} of {:g} Hz", rt::name(last_.phase),
                                         static_cast<double>(worked_off - told_cycles_) / elapsed_s,
                                         config_.control.rate_hz);
    line += fmt::format(
        ", late {}, on time {:.3f} %, bus {:.0f} %, model {:.0f} Hz", last_.late_cycles, on_time_percent(),
        100 * static_cast<double>(bus_bits_ - told_bus_bits_) / elapsed_s / config_.bus.bitrate,
        static_cast<double>(refreshes - told_refreshes_) / elapsed_s);
    for (const rt::FaultRule& rule : rt::kFaultTable)
      if (last_.faults.has(rule.fault)) line += fmt::format("; {}", rule.words);
    for (std::size_t s = 0; s < config_.sensors.size(); ++s)
      if (watch_.losses()[s].lost) line += "; " + loss(config_.sensors[s].frame);
    service_.status(line);
    told_ns_ = now_ns;
    told_cycles_ = worked_off;
    told_bus_bits_ = bus_bits_;
    told_refreshes_ = refreshes;
  }

  /// What a real-time thread must not do: each may wait for the kernel's locks or for a disk.
  void tell_stalls() {
    if (!stalls_untold_) return;
    stalls_untold_ = false;
    spdlog::warn("the control thread has taken {} page faults and made {} heap calls; there should be none",
                 last_.page_faults, last_.heap_calls);
  }

  void show_progress(std::int64_t now_ns) {
    next_progress_ns_ = now_ns + kProgress_ns;
    // Whoever reads our output may have stopped reading; the robot does not wait for them.
    pollfd output{STDOUT_FILENO, POLLOUT, 0};
    if (poll(&output, 1, 0) != 1 || (output.revents & POLLOUT) == 0) return;
    std::string error = "-";
    if (recorder_ && recorder_->last_error_mm())
      error = fmt::format("{:.2f} mm", *recorder_->last_error_mm());
    const double elapsed = running_since_ns_ > 0 ? 1e-9 * static_cast<double>(now_ns - running_since_ns_) : 0;
    const double rate =
        model_.active_seconds() > 0 ? static_cast<double>(model_.refreshes()) / model_.active_seconds() : 0;
    fmt::print("{:5.0f} s  {:8}  error {:>8}  model {:5.0f} Hz  late {}\n", elapsed, rt::name(last_.phase),
               error, rate, last_.late_cycles);
    std::fflush(stdout);
  }

  const Config& config_;
  const DaemonOptions& options_;
  Channels& channels_;
  const ModelThread& model_;
  const hal::DriveMaster& master_;
  std::vector<bool> introduced_;  // one a drive
  rt::EffectorVector rest_;       // where effectors that do not move stay
  RunRecorder* recorder_;
  ServiceManager& service_;
  std::optional<Motion> motion_;
  SensorWatch watch_;
  rt::TraceRecord last_;
  std::int64_t running_since_ns_ = 0, next_progress_ns_ = 0, next_tale_ns_ = 0;
  std::int64_t bus_bits_ = 0;
  bool stalls_untold_ = false;  // a page fault or heap call that nobody has been told of
  std::int64_t told_ns_ = rt::now_ns(), told_cycles_ = 0, told_bus_bits_ = 0;  // with the last status
  std::uint64_t told_refreshes_ = 0;
};

std::string stop_reason(const Config& config, const rt::Controller& controller,
                        const hal::DriveMaster& master) {
  if (!controller.faulted()) return "";
  if (controller.stop_reason() == rt::Fault::kSensorLost)
    return loss(config.sensors[controller.lost_sensor()].frame);
  if (controller.stop_reason() == rt::Fault::kDrives) return master.describe(controller.drive_fault());
  return rt::rule(controller.stop_reason()).words;
}

}  // namespace

int run_daemon(const Config& config, const DaemonOptions& options) {
  check_bus(config);
  const auto robot = build_model(config);
  const rt::EffectorVector rest = rest_of_effectors(*robot);
  const bool memory_locked = lock_memory(options.allow_non_rt);
  const auto idle_latency_limit = limit_idle_latency(config.control.idle_latency);

  const auto channels = std::make_unique<Channels>();
  const auto counts = std::make_unique<rt::LoopCounts>();
  std::optional<RunRecorder> recorder;
  if (!options.report.empty()) recorder.emplace(config, options.report);
  const auto master = hal::make_master(master_config(config));
  rt::ControllerConfig limits = controller_config(config);
  if (!config.control.iteration_cap)
    limits.iteration_cap = judge_qp(config, time_iteration(*robot, config)).cap;
  rt::Controller controller(limits);

  const auto bus = hal::open_bus(options.bus.empty() ? config.bus.name : options.bus, hal::BusRole::kJoin,
                                 master->identifiers());
  const size_t m = config.actuators.size();
  spdlog::info("{}: {} on {}", config.robot, m == 1 ? "one actuator" : fmt::format("{} actuators", m),
               bus->describe());
  for (const std::string& warning : warnings_on_drives(config)) spdlog::warn("{}", warning);
  rt::ControlLoop loop(*bus, *master, controller, channels->snapshots, channels->targets, channels->feedback,
                       channels->requests);
  ModelThread model(*robot, config, *channels);
  ServiceManager service;
  {
    Housekeeping housekeeping(config, options, *channels, model, *master, rest,
                              recorder ? &*recorder : nullptr, service);
    rt::RealtimeThread control({"control", config.control.priority, config.control.cpu},
                               options.allow_non_rt ? rt::RtRights::kIgnore : rt::RtRights::kRequire, [&] {
                                 rt::PeriodicClock clock(config.control.rate_hz);
                                 loop.run(clock, channels->trace, *counts, channels->progress);
                               });
    // Whatever throws from here on: the thread that `control` waits for has been told to end.
    const StopAtExit stop_at_exit{channels->requests};
    // Not before: threads are born with the CPUs of the one that makes them.
    rt::keep_to_cpu(pthread_self(), "housekeeping", config.control.housekeeping_cpu);
    if (!control.refusal().empty()) spdlog::warn("{}", control.refusal());
    while (!channels->progress.ended.load(std::memory_order_acquire)) {
      housekeeping.tend();
      std::this_thread::sleep_for(kHousekeeping);
    }
    control.join();
    housekeeping.drain();
  }
  model.stop();

  const std::string reason = stop_reason(config, controller, *master);
  if (!reason.empty()) {
    service.status("stopped: " + reason);
    spdlog::error("stopped: {}", reason);
  }
  spdlog::info("drives disabled; {} cycles, {} late, {:.3f} % on time; {} model refreshes, {} failed",
               counts->cycles, counts->late_cycles, 100 * counts->success_rate(), model.refreshes(),
               model.failures());
  if (recorder) {
    recorder->finish({.nodes = robot->model.mesh().node_count(),
                      .tetrahedra = robot->model.mesh().tet_count(),
                      .bus = bus->describe(),
                      .memory_locked = memory_locked,
                      .iteration_cap = limits.iteration_cap,
                      .model_refreshes = model.refreshes(),
                      .model_seconds = model.active_seconds(),
                      .trace_dropped = channels->trace.dropped(),
                      .bus_dropped = bus->dropped(),
                      .stop_reason = reason},
                     *counts);
    draw_report(options.report);
  }
  return reason.empty() ? 0 : 1;
}

}  // namespace tendril::app
