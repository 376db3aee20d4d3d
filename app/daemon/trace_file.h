// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "app/config/config.h"
#include "app/daemon/measured_signals.h"
#include "app/robot/motion.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// Whether the effectors are on their way to the first waypoint in that cycle.
/// @param motion  the path that is followed, once it is
bool approaches(const rt::TraceRecord& record, const Motion* motion);

/// The trace of a run as CSV, one row a cycle; docs/report.md describes it.
class TraceFile {
 public:
  /// Opens the file and writes its header. Keeps a reference to the configuration.
  /// @throws std::runtime_error where it cannot be written
  TraceFile(const Config& config, const std::filesystem::path& file);

  /// One cycle, in order.
  /// @param motion  the path that is followed, once it is
  void add(const rt::TraceRecord& record, const Motion* motion);

  /// @return  whether all rows have been written
  bool close();

 private:
  void write_header();
  std::string tip_cells(const rt::TraceRecord& record) const;
  std::string cell(const rt::TraceRecord& record, const std::optional<Reading>& reading, int decimals) const;
  double seconds(int64_t stamp_ns) const { return 1e-9 * static_cast<double>(stamp_ns - first_ns_); }

  const Config& config_;
  MeasuredSignals signals_;
  NewSamples new_samples_;
  std::ofstream csv_;
  int64_t first_ns_ = 0;
};

}  // namespace tendril::app
