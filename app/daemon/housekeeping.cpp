// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/housekeeping.h"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdio>
#include <iterator>
#include <utility>

#include "app/program/output.h"
#include "app/program/stop_signal.h"
#include "app/robot/control_stack.h"
#include "app/robot/robot_geometry.h"
#include "rt/periodic_clock.h"

namespace tendril::app {
namespace {

constexpr int64_t kStatusInterval_ns = 1'000'000'000;

}  // namespace

Housekeeping::Housekeeping(const Config& config, const DaemonOptions& options, rt::Channels& channels,
                           const ModelThread& model, const hal::DriveMaster& master, rt::EffectorVector rest,
                           RunRecorder* recorder, TelemetryLog* log, ServiceManager& service)
    : config_(config),
      options_(options),
      channels_(channels),
      model_(model),
      master_(master),
      recorder_(recorder),
      telemetry_(log),
      service_(service),
      log_(config, master),
      status_(config, rt::now_ns()),
      targets_(config, std::move(rest)),
      status_due_ns_(rt::now_ns() + kStatusInterval_ns) {
  if (!options.socket.empty()) server_.emplace(options.socket, config, targets_, channels.requests, master);
  tell_metrics();
}

void Housekeeping::show_body(const Robot& robot, const Config& config) {
  if (server_) server_->show_body(robot_geometry(config, robot.model.mesh()), channels_.surface);
}

void Housekeeping::run_once() {
  const int64_t now_ns = rt::now_ns();
  begin_run();
  if (server_) server_->serve();
  if (metrics_server_) metrics_server_->serve();
  send_target(rt::now_ns());
  pass_on_stop(now_ns);
  drain();
  log_.log_identities();
  inform_service_manager(now_ns);
  print_progress(now_ns);
  if (telemetry_) telemetry_->add(progress(), now_ns);
}

/// At an address, if anybody wants metrics.
void Housekeeping::tell_metrics() {
  if (options_.metrics.empty()) return;
  metrics_.emplace(config_);
  metrics_server_.emplace(options_.metrics, [this] {
    return metrics_->text(progress(), telemetry_ ? std::optional(telemetry_->counts()) : std::nullopt);
  });
  const std::string url = "http://" + metrics_server_->address() + "/metrics";
  spdlog::info("metrics: {}", url);
  if (!metrics_server_->is_local()) spdlog::warn("all who reach this machine can read {}", url);
}

RunProgress Housekeeping::progress() const {
  return {model_.refreshes(), model_.failures(), model_.mean_rate_hz(), channels_.trace.dropped()};
}

/// Once the drives follow commands.
void Housekeeping::begin_run() {
  if (!channels_.run_starts.fresh()) return;
  const rt::RunStart& start = channels_.run_starts.latest();
  if (running_since_ns_ == 0) running_since_ns_ = start.stamp_ns;
  targets_.begin(start);
}

void Housekeeping::note_fault(const rt::LatchedFault& fault) {
  if (fault.present == !fault_.empty()) return;
  if (recorder_ && !fault.present) recorder_->add_reset(fault_);
  fault_ = describe(fault, config_, master_);
}

void Housekeeping::send_target(int64_t now_ns) {
  const auto target = targets_.at(now_ns);
  if (!target) return;
  channels_.targets.back() = *target;
  channels_.targets.publish();
  if (telemetry_) telemetry_->add(*target, targets_);
}

void Housekeeping::wait(std::chrono::milliseconds limit) const {
  pollfd requests[] = {{server_ ? server_->descriptor() : -1, POLLIN, 0},
                       {metrics_server_ ? metrics_server_->descriptor() : -1, POLLIN, 0}};
  ::poll(requests, std::size(requests), static_cast<int>(limit.count()));
}

double Housekeeping::running_s(int64_t now_ns) const {
  return running_since_ns_ > 0 ? 1e-9 * static_cast<double>(now_ns - running_since_ns_) : 0;
}

void Housekeeping::pass_on_stop(int64_t now_ns) {
  const bool time_is_up = options_.duration_s > 0 && running_s(now_ns) > options_.duration_s;
  if (stop_signalled() || time_is_up) channels_.requests.stop = true;
}

void Housekeeping::drain() {
  rt::TraceRecord record;
  while (channels_.trace.pop(record)) {
    begin_run();  // the start of a run is there before its first record
    if (targets_.begun() && record.phase > rt::Phase::kRunning &&
        record.intended_ns > channels_.run_starts.latest().stamp_ns)
      targets_.end();
    note_fault(record.latched);
    log_.add(record);
    status_.add(record);
    if (recorder_) recorder_->add(record, targets_.undisturbed_path());
    if (telemetry_) telemetry_->add(record, targets_.undisturbed_path());
    if (metrics_) metrics_->add(record, targets_.undisturbed_path());
    if (server_) server_->add(record);
  }
}

void Housekeeping::inform_service_manager(int64_t now_ns) {
  const rt::Phase phase = channels_.progress.phase.load(std::memory_order_acquire);
  // A robot that waits for its operator is ready, too.
  const bool serves = running_since_ns_ > 0 || phase == rt::Phase::kStandby;
  if (serves && !std::exchange(said_ready_, true)) service_.ready();
  const bool stops = channels_.requests.stop || phase >= rt::Phase::kDisabling;
  if (stops && !std::exchange(said_stopping_, true)) service_.stopping();
  service_.feed_watchdog(now_ns, status_.last().cycles);
  if (now_ns < status_due_ns_) return;
  status_due_ns_ = now_ns + kStatusInterval_ns;
  service_.status(status_.service_line(now_ns, model_.refreshes(), log_.sensor_losses(), fault_));
  log_.log_stalls();
}

void Housekeeping::print_progress(int64_t now_ns) {
  if (now_ns < progress_due_ns_) return;
  progress_due_ns_ = now_ns + kStatusInterval_ns;
  if (!takes_a_line(STDOUT_FILENO) || is_journal(STDOUT_FILENO))
    return;  // the service manager has a status line
  fmt::print("{}\n",
             status_.terminal_line(running_s(now_ns), recorder_ ? recorder_->last_error_mm() : std::nullopt,
                                   model_.mean_rate_hz()));
  std::fflush(stdout);
}

}  // namespace tendril::app
