// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/config/config.h"
#include "app/daemon/run_statistics.h"
#include "app/daemon/trace_file.h"
#include "app/robot/motion.h"
#include "rt/cycle_log.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// Facts of a run that the trace does not hold.
struct RunFacts {
  int nodes = 0, tetrahedra = 0;
  std::string bus;
  bool memory_locked = false;
  int iteration_cap = 0;  ///< of the QP
  uint64_t model_refreshes = 0;
  double model_rate_hz = 0;    ///< of refreshes, mean over the run
  uint64_t trace_dropped = 0;  ///< records that found the ring full
  uint64_t bus_dropped = 0;    ///< frames that found a queue full
  std::string stop_reason;     ///< empty where the run ended as asked
};

/// Keeps the record of a run: the trace as CSV while it goes on, the figures in summary.json at its end.
/// docs/report.md describes both files.
class RunRecorder {
 public:
  /// Makes the folder and opens DIR/trace.csv. Keeps a reference to the configuration.
  /// @throws std::runtime_error where the folder cannot be written
  RunRecorder(const Config& config, const std::filesystem::path& directory);

  /// One cycle, in order.
  /// @param motion  the path that is followed; nullptr where it is none but what an operator asks for
  void add(const rt::TraceRecord& record, const Motion* motion) {
    trace_.add(record, motion);
    statistics_.add(record, motion);
  }

  /// A fault has been reset, so that the run goes on.
  void add_reset(const std::string& fault) { resets_.push_back(fault); }

  /// Error of the tip when it was measured last, mm; nothing where it was not, on the path.
  std::optional<double> last_error_mm() const { return statistics_.last_error_mm(); }

  /// Closes the trace and writes DIR/summary.json.
  /// @throws std::runtime_error where not all could be written
  void finish(const RunFacts& facts, const rt::LoopCounts& counts);

  /// Writes DIR/robot.json.
  /// @param geometry  of robot_geometry()
  /// @throws std::runtime_error where not all could be written
  void add_geometry(const std::string& geometry);

 private:
  const Config& config_;
  std::filesystem::path directory_;
  TraceFile trace_;
  RunStatistics statistics_;
  std::vector<std::string> resets_;
};

}  // namespace tendril::app
