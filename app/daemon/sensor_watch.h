// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/config/config.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// Finds in the trace of a run when a sensor goes stale and when it is back. Sensors count while the drives
/// follow their commands, from the first such cycle on. Real-time: no, for all of it (allocates).
class SensorWatch {
 public:
  struct Change {
    std::size_t sensor;
    bool lost;       ///< has gone stale; else it is back
    double stale_s;  ///< for how long it was stale, where it is back
  };

  /// What has become of one sensor.
  struct Losses {
    bool lost = false;     ///< at present
    int count = 0;         ///< how often it went stale
    int64_t since_ns = 0;  ///< cycle of the last loss
    int64_t stale_ns = 0;  ///< in all

    double stale_s() const { return 1e-9 * static_cast<double>(stale_ns); }
  };

  explicit SensorWatch(const Config& config) : losses_(config.sensors.size()) {}

  /// One cycle, in order.
  /// @return  what has changed with it
  std::vector<Change> add(const rt::TraceRecord& record);

  const std::vector<Losses>& losses() const { return losses_; }  ///< one a sensor

 private:
  std::vector<Losses> losses_;
  int64_t last_ns_ = 0;  // the cycle before
};

}  // namespace tendril::app
