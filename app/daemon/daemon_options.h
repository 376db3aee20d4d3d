// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace tendril::app {

/// What the command line says of a run.
struct DaemonOptions {
  std::string bus;               ///< replaces the configuration's where not empty
  double duration_s = 0;         ///< of running, 0: until a signal
  std::filesystem::path report;  ///< folder of the report; empty: none
  std::filesystem::path log;     ///< NAME.mcap; empty: none
  double log_size_mb = 1000;     ///< of all its files
  std::string metrics;           ///< address and port for Prometheus; empty: none
  std::filesystem::path socket;  ///< where operators connect; empty: nowhere
  bool allow_non_rt = false;     ///< run without SCHED_FIFO and locked memory where they are refused
};

}  // namespace tendril::app
