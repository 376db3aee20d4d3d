// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "app/config/config.h"
#include "app/daemon/run_progress.h"
#include "app/daemon/sample_errors.h"
#include "app/daemon/sensor_watch.h"
#include "app/mcap/mcap_recorder.h"
#include "app/metrics/metrics_text.h"
#include "app/metrics/value_histogram.h"
#include "app/robot/motion.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// The figures of a run as Prometheus reads them; docs/logs.md lists them. Real-time: no, for all of it
/// (allocates).
class RunMetrics {
 public:
  /// Keeps a reference to the configuration.
  explicit RunMetrics(const Config& config);

  /// One cycle, in order.
  /// @param motion  the path that is followed; nullptr where it is none but what an operator asks for
  void add(const rt::TraceRecord& record, const Motion* motion);

  /// @param log  nothing where there is none
  std::string text(const RunProgress& progress, const std::optional<McapRecorder::Counts>& log) const;

 private:
  void put_cycles(MetricsText& text) const;
  void put_controller(MetricsText& text) const;
  void put_model(MetricsText& text, const RunProgress& progress) const;
  void put_actuators(MetricsText& text) const;
  void put_sensors(MetricsText& text) const;

  const Config& config_;
  SensorWatch watch_;
  SampleErrors errors_;
  rt::TraceRecord last_;
  ValueHistogram wakeup_, work_, tip_error_;
  std::array<uint64_t, rt::kFaultKinds> fault_cycles_{};
  std::map<std::string, uint64_t> solutions_;  // of the QP, by status
  uint64_t iterations_ = 0;
  int64_t bus_bits_ = 0;
};

}  // namespace tendril::app
