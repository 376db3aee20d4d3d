// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "app/config/config.h"
#include "app/daemon/daemon_options.h"
#include "app/daemon/run_log.h"
#include "app/daemon/run_metrics.h"
#include "app/daemon/run_progress.h"
#include "app/daemon/run_recorder.h"
#include "app/daemon/run_status.h"
#include "app/daemon/service_manager.h"
#include "app/daemon/telemetry_log.h"
#include "app/metrics/metrics_server.h"
#include "app/operation/control_server.h"
#include "app/operation/target_source.h"
#include "app/robot/model_thread.h"
#include "app/robot/robot.h"
#include "hal/drive/drives.h"
#include "rt/channels.h"

namespace tendril::app {

/// What the main thread does while the control thread runs: serves operators and metrics, sends targets,
/// passes on requests to stop, drains the trace, informs people and the service manager. Real-time: no, for
/// all of it (allocates, may block).
class Housekeeping {
 public:
  /// Keeps references.
  /// @param rest      where effectors that do not move stay, e, m or m³
  /// @param recorder  nullptr: nobody wants a record
  /// @param log       nullptr: nobody wants a log
  /// @throws std::runtime_error where operators or Prometheus cannot be listened to, see LineServer and
  ///         MetricsServer
  Housekeeping(const Config& config, const DaemonOptions& options, rt::Channels& channels,
               const ModelThread& model, const hal::DriveMaster& master, rt::EffectorVector rest,
               RunRecorder* recorder, TelemetryLog* log, ServiceManager& service);

  /// Real-time: no.
  RunProgress progress() const;

  /// Operators may see the body from now on.
  void show_body(const Robot& robot, const Config& config);

  /// One round. What the control thread waits for comes first, what may take its time last. Call it once more
  /// after the control thread has ended.
  void run_once();

  /// Waits until an operator asks for something, at most some time. Real-time: no.
  void wait(std::chrono::milliseconds limit) const;

 private:
  void drain();
  void begin_run();
  void note_fault(const rt::LatchedFault& fault);
  void tell_metrics();
  void send_target(int64_t now_ns);
  void pass_on_stop(int64_t now_ns);
  void inform_service_manager(int64_t now_ns);
  void print_progress(int64_t now_ns);
  double running_s(int64_t now_ns) const;

  const Config& config_;
  const DaemonOptions& options_;
  rt::Channels& channels_;
  const ModelThread& model_;
  const hal::DriveMaster& master_;
  RunRecorder* recorder_;
  TelemetryLog* telemetry_;
  ServiceManager& service_;
  RunLog log_;
  RunStatus status_;
  TargetSource targets_;
  std::optional<ControlServer> server_;
  std::string fault_;  // latched; empty: none
  std::optional<RunMetrics> metrics_;
  std::optional<MetricsServer> metrics_server_;
  bool said_ready_ = false, said_stopping_ = false;  // to the service manager
  int64_t running_since_ns_ = 0, status_due_ns_, progress_due_ns_ = 0;
};

}  // namespace tendril::app
