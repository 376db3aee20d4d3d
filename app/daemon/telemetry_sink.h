// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <spdlog/spdlog.h>

#include "app/daemon/telemetry_log.h"

namespace tendril::app {

/// Hands every line of the program's log to a telemetry log too, as long as it lives. To be made and gone
/// while no other thread logs. Real-time: no.
class TelemetrySink {
 public:
  /// Keeps a reference.
  explicit TelemetrySink(TelemetryLog& log);
  ~TelemetrySink();
  TelemetrySink(const TelemetrySink&) = delete;
  TelemetrySink& operator=(const TelemetrySink&) = delete;

 private:
  spdlog::sink_ptr sink_;
};

}  // namespace tendril::app
