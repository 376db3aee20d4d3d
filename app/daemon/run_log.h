// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "app/config/config.h"
#include "app/daemon/sensor_watch.h"
#include "hal/drive/drives.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// What the log says of a run: phases, drives that answer, faults, sensors that are lost or back, page faults
/// and heap calls of the control thread. Real-time: no, for all of it (allocates, writes the log).
class RunLog {
 public:
  /// Keeps references.
  RunLog(const Config& config, const hal::DriveMaster& master);

  /// One cycle, in order. Faults that come and go are logged at most once a second.
  void add(const rt::TraceRecord& record);

  /// Logs which drives have answered, each once.
  void log_identities();

  /// Logs page faults and heap calls that have come since the last time.
  void log_stalls();

  const std::vector<SensorWatch::Losses>& sensor_losses() const { return sensors_.losses(); }

 private:
  void log_faults(rt::FaultSet faults, int64_t now_ns);
  void log_sensor(const SensorWatch::Change& change);

  const Config& config_;
  const hal::DriveMaster& master_;
  std::vector<bool> identified_;  // one a drive
  SensorWatch sensors_;
  rt::TraceRecord last_;
  int64_t faults_due_ns_ = 0;  // before this instant no change of faults is logged
  bool new_stalls_ = false;
};

}  // namespace tendril::app
