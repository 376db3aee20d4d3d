#pragma once

#include <filesystem>
#include <string>

#include "app/config/config.h"

namespace tendril::app {

struct DaemonOptions {
  std::string bus;               ///< replaces the configuration's where not empty
  double duration_s = 0;         ///< of running, 0: until a signal
  std::filesystem::path report;  ///< folder of the report; empty: none
  bool allow_non_rt = false;     ///< run without SCHED_FIFO and locked memory where they are refused
};

/// Runs a robot from the first frame on the bus to disabled drives. Ends on SIGTERM or SIGINT, after the
/// given time, or on a fault of those that stop.
/// @return  exit code: 0 the run ended as asked, 1 it ended on a fault
/// @throws  ConfigError; rt::RtError where real-time rights are missing; hal::BusError where the bus cannot
/// be opened Real-time: no; it starts the control thread, which is.
int run_daemon(const Config& config, const DaemonOptions& options);

}  // namespace tendril::app
