// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/config/config.h"
#include "app/daemon/sensor_watch.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// How a run goes, in one line for the service manager and one for the terminal. Real-time: no, for all of it
/// (allocates).
class RunStatus {
 public:
  /// Keeps a reference to the configuration.
  /// @param now_ns  from here on rates are counted
  RunStatus(const Config& config, int64_t now_ns);

  /// One cycle, in order.
  void add(const rt::TraceRecord& record);

  /// The line of `systemctl status`: phase, rates since the last such line, faults, lost sensors. What stands
  /// still shows.
  /// @param model_refreshes  so far
  /// @param sensors          one a sensor
  /// @param fault            that waits for a reset, a sentence; empty: none
  std::string service_line(int64_t now_ns, uint64_t model_refreshes,
                           const std::vector<SensorWatch::Losses>& sensors, const std::string& fault);

  /// The line of the terminal.
  /// @param running_s      how long the drives have followed commands
  /// @param error_mm       of the tip, where it is measured
  /// @param model_rate_hz  mean over the run
  std::string terminal_line(double running_s, std::optional<double> error_mm, double model_rate_hz) const;

  const rt::TraceRecord& last() const { return last_; }

 private:
  /// What has been counted until an instant.
  struct Counts {
    int64_t at_ns = 0, cycles = 0, bus_bits = 0;
    uint64_t model_refreshes = 0;
  };

  const Config& config_;
  rt::TraceRecord last_;
  int64_t bus_bits_ = 0;
  Counts before_;  // with the last service line
};

}  // namespace tendril::app
