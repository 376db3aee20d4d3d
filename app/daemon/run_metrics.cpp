// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/run_metrics.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "app/daemon/deadline_latencies.h"
#include "app/daemon/reaction_name.h"
#include "qp/solver.h"

namespace tendril::app {
namespace {

// Fine about the periods of usual rates, 1 to 5 ms, and below.
const std::vector<double> kLatencyBounds_s{10e-6, 20e-6, 50e-6, 100e-6, 200e-6, 500e-6, 1e-3,
                                           2e-3,  5e-3,  10e-3, 20e-3,  50e-3,  0.1,    1};
const std::vector<double> kTipErrorBounds_m{0.1e-3, 0.2e-3, 0.5e-3, 1e-3, 2e-3, 5e-3, 10e-3, 20e-3, 50e-3};

constexpr std::array kPhases{rt::Phase::kConnecting, rt::Phase::kModelling, rt::Phase::kEnabling,
                             rt::Phase::kRunning,    rt::Phase::kStopping,  rt::Phase::kStandby,
                             rt::Phase::kDisabling,  rt::Phase::kStopped};

double in_seconds(int64_t ns) { return 1e-9 * static_cast<double>(ns); }

double cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto of = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return of(usage.ru_utime) + of(usage.ru_stime);
}

}  // namespace

RunMetrics::RunMetrics(const Config& config)
    : config_(config),
      watch_(config),
      errors_(config),
      wakeup_(kLatencyBounds_s),
      work_(kLatencyBounds_s),
      tip_error_(kTipErrorBounds_m) {
  for (const qp::Status status :
       {qp::Status::kOptimal, qp::Status::kSoftened, qp::Status::kCapped, qp::Status::kIllPosed})
    solutions_[qp::name(status)] = 0;
}

void RunMetrics::add(const rt::TraceRecord& record, const Motion* motion) {
  for_each_latency(record, 1 / config_.control.rate_hz, [this](double latency_s) { wakeup_.add(latency_s); });
  work_.add(in_seconds(record.cycle_ns));
  for (const rt::FaultRule& rule : rt::kFaultTable)
    if (record.faults.has(rule.fault)) ++fault_cycles_[static_cast<std::size_t>(rule.fault)];
  if (record.qp_solved) ++solutions_[qp::name(record.qp_status)];
  iterations_ += static_cast<uint64_t>(record.qp_iterations);
  bus_bits_ += record.bus_bits;
  watch_.add(record);
  errors_.add(record, motion);
  if (const auto& tip = errors_.tip()) tip_error_.add(tip->to_path);
  last_ = record;
}

std::string RunMetrics::text(const RunProgress& progress,
                             const std::optional<McapRecorder::Counts>& log) const {
  MetricsText text;
  text.gauge("tendril_info", "1; what runs.");
  text.add({{"robot", config_.robot}, {"version", TENDRIL_VERSION}}, 1);
  text.gauge("tendril_phase", "1 for the phase in which the run is.");
  for (const rt::Phase phase : kPhases) text.add({{"phase", rt::name(phase)}}, phase == last_.phase ? 1 : 0);
  put_cycles(text);
  put_controller(text);
  put_model(text, progress);
  put_actuators(text);
  put_sensors(text);
  text.counter("tendril_trace_dropped_cycles_total", "Cycles that none of these figures knows.");
  text.add(static_cast<double>(progress.trace_dropped));
  if (log) {
    text.counter("tendril_log_dropped_messages_total", "Messages that are missing from the log.");
    text.add(static_cast<double>(log->dropped));
    text.counter("tendril_log_written_bytes_total", "Bytes written to the log.");
    text.add(static_cast<double>(log->bytes));
  }
  text.counter("process_cpu_seconds_total", "CPU time of all threads.");
  text.add(cpu_seconds());
  return text.text();
}

void RunMetrics::put_cycles(MetricsText& text) const {
  text.gauge("tendril_control_period_seconds", "Time between two deadlines of the control thread.");
  text.add(1 / config_.control.rate_hz);
  text.counter("tendril_cycles_total", "Deadlines of the control thread that passed, missed ones included.");
  text.add(static_cast<double>(last_.cycles));
  text.counter("tendril_late_cycles_total", "Of these, the missed ones.");
  text.add(static_cast<double>(last_.late_cycles));
  text.histogram("tendril_wakeup_latency_seconds",
                 "From a deadline to the wake-up; a stall counts for every deadline that it covers.",
                 wakeup_);
  text.histogram("tendril_cycle_work_seconds", "From the wake-up to the end of the cycle's work.", work_);
  text.counter("tendril_heap_calls_total", "Heap calls of the control thread; there should be none.");
  text.add(static_cast<double>(last_.heap_calls));
  text.counter("tendril_page_faults_total", "Page faults of the control thread; there should be none.");
  text.add(static_cast<double>(last_.page_faults));
  text.counter("tendril_bus_busy_seconds_total", "For how long our frames needed the bus, at worst.");
  text.add(static_cast<double>(bus_bits_) / config_.bus.bitrate);
}

void RunMetrics::put_controller(MetricsText& text) const {
  text.gauge("tendril_fault", "1 for a fault that is present.");
  for (const rt::FaultRule& rule : rt::kFaultTable)
    text.add({{"fault", rule.words}, {"reaction", name(rule.reaction)}},
             last_.faults.has(rule.fault) ? 1 : 0);
  text.counter("tendril_fault_cycles_total", "Cycles in which a fault was present.");
  for (const rt::FaultRule& rule : rt::kFaultTable)
    text.add({{"fault", rule.words}, {"reaction", name(rule.reaction)}},
             static_cast<double>(fault_cycles_[static_cast<std::size_t>(rule.fault)]));
  text.counter("tendril_qp_solutions_total", "QPs solved, by status.");
  for (const auto& [status, count] : solutions_) text.add({{"status", status}}, static_cast<double>(count));
  text.counter("tendril_qp_iterations_total", "Iterations of all these QPs.");
  text.add(static_cast<double>(iterations_));
  const auto& tip = errors_.signals().tip;
  if (!std::ranges::any_of(tip, [](const auto& index) { return index.has_value(); })) return;
  text.histogram("tendril_tip_error_meters", "From the measured tip to where it was wanted at that time.",
                 tip_error_);
}

void RunMetrics::put_model(MetricsText& text, const RunProgress& progress) const {
  text.counter("tendril_model_refreshes_total", "Snapshots that the model thread published.");
  text.add(static_cast<double>(progress.model_refreshes));
  text.counter("tendril_model_failures_total", "Refreshes that found no usable pose.");
  text.add(static_cast<double>(progress.model_failures));
  text.gauge("tendril_snapshot_age_seconds", "Age of the pose that the last cycle used.");
  text.add(in_seconds(last_.snapshot_age_ns));
}

void RunMetrics::put_actuators(MetricsText& text) const {
  struct Family {
    const char *name, *help;
    bool of_cavities;
    const std::array<double, rt::kMaxActuators>& values;
  };
  for (const Family& family :
       {Family{"tendril_actuator_command_meters", "Commanded displacement.", false, last_.command},
        Family{"tendril_actuator_displacement_meters", "Displacement as the drive measures it.", false,
               last_.measured},
        Family{"tendril_actuator_effort_newtons", "Effort in the solution of the QP.", false, last_.lambda},
        Family{"tendril_actuator_command_cubic_meters", "Commanded growth of the cavity.", true,
               last_.command},
        Family{"tendril_actuator_displacement_cubic_meters", "Growth as the drive measures it.", true,
               last_.measured},
        Family{"tendril_actuator_effort_pascals", "Pressure in the solution of the QP.", true,
               last_.lambda}}) {
    bool begun = false;
    for (std::size_t a = 0; a < config_.actuators.size(); ++a) {
      if (config_.actuators[a].is_cavity() != family.of_cavities) continue;
      if (!std::exchange(begun, true)) text.gauge(family.name, family.help);
      text.add({{"actuator", config_.actuators[a].name}}, family.values[a]);
    }
  }
}

void RunMetrics::put_sensors(MetricsText& text) const {
  if (config_.sensors.empty()) return;
  const auto each = [&](auto value) {
    for (std::size_t s = 0; s < config_.sensors.size(); ++s)
      text.add({{"sensor", config_.sensors[s].frame.name}}, static_cast<double>(value(watch_.losses()[s])));
  };
  text.gauge("tendril_sensor_lost", "1 for a sensor that is silent while the drives follow.");
  each([](const SensorWatch::Losses& losses) { return losses.lost ? 1 : 0; });
  text.counter("tendril_sensor_losses_total", "How often a sensor fell silent.");
  each([](const SensorWatch::Losses& losses) { return losses.count; });
  text.counter("tendril_sensor_lost_seconds_total", "For how long in all.");
  each([](const SensorWatch::Losses& losses) { return losses.stale_s(); });
}

}  // namespace tendril::app
