// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "app/config/config.h"
#include "app/daemon/json_text.h"
#include "app/daemon/measured_signals.h"
#include "app/daemon/run_progress.h"
#include "app/daemon/run_recorder.h"
#include "app/daemon/sample_errors.h"
#include "app/daemon/sensor_watch.h"
#include "app/daemon/telemetry_topics.h"
#include "app/mcap/mcap_recorder.h"
#include "app/operation/target_source.h"
#include "app/robot/motion.h"
#include "rt/cycle_log.h"
#include "rt/target.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// The log of a run as an MCAP file, for tools of others: every cycle, target, snapshot and sample, what was
/// logged, and once a second how the run goes. docs/logs.md describes it. Its times are those of
/// CLOCK_MONOTONIC, moved once so that they count from 1970. Real-time: no, for all of it (allocates, takes a
/// lock); it never waits for the disk.
class TelemetryLog {
 public:
  /// Opens the log and starts its thread. Keeps a reference to the configuration.
  /// @param file         NAME.mcap; older ones become NAME.1.mcap and so on, see NumberedFiles
  /// @param total_bytes  of all these files
  /// @param facts        what is known before the run
  /// @throws std::runtime_error where the file cannot be written
  TelemetryLog(const Config& config, const std::filesystem::path& file, uint64_t total_bytes,
               const RunFacts& facts);

  /// One cycle, in order.
  /// @param motion  the path that is followed; nullptr where it is none but what an operator asks for
  void add(const rt::TraceRecord& record, const Motion* motion);

  /// What was sent to the control thread.
  void add(const rt::Target& target, const TargetSource& source);

  /// To be called often: once a second it records how the run goes, and logs where messages were dropped.
  void add(const RunProgress& progress, int64_t now_ns);

  /// A line of the program's log. Any thread.
  /// @param level  2 info, 3 warning, 4 error
  void add_line(int level, const std::string& line);

  /// The run has ended: records the rest and closes the log. Says so where something is missing.
  void finish(const RunProgress& progress, const RunFacts& facts, const rt::LoopCounts& counts);

  pthread_t thread() { return recorder_.thread(); }
  McapRecorder::Counts counts() const { return recorder_.counts(); }

 private:
  struct Sensor {
    int64_t known_ns = 0;  // of the last sample
    std::vector<ValueGroup> groups;
  };

  void record_status(const RunProgress& progress, int64_t now_ns);
  void record(Topic topic, int64_t log_ns, int64_t publish_ns);
  void put(std::string_view name, const std::vector<ValueGroup>& groups, const double* values);
  void put_state(const rt::TraceRecord& record, const Motion* motion);
  void add_snapshot(const rt::TraceRecord& record);
  void add_samples(const rt::TraceRecord& record);
  void add_errors(const rt::TraceRecord& record, const Motion* motion);
  void log_dropped(int64_t now_ns);

  const Config& config_;
  std::filesystem::path file_;
  int64_t offset_ns_;  // from CLOCK_MONOTONIC to the times of the log
  std::vector<ValueGroup> coordinates_;
  std::vector<std::string> actuators_;  // names in quotes
  std::vector<Sensor> sensors_;
  SensorWatch watch_;
  SampleErrors errors_;
  JsonText json_;
  uint64_t snapshot_ = 0;  // sequence of the last one
  int64_t snapshot_ns_ = 0, status_due_ns_ = 0, drops_due_ns_ = 0;
  uint64_t drops_told_ = 0;
  McapRecorder recorder_;
};

}  // namespace tendril::app
