// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "app/config/config.h"

namespace tendril::app {

struct SimulationOptions {
  double duration_s = 0;         ///< of virtual time once the drives follow commands
  double model_rate_hz = 60;     ///< refreshes of the model a second of virtual time
  std::filesystem::path report;  ///< folder of the report; empty: none
};

/// Runs a robot file, controller, drives and simulated body, under a virtual clock, as fast as this machine
/// can. The same file and options give the same numbers on every run. Prints how it goes and how far the true
/// tip was from its path; leaves the report of a run. A stop signal ends it early.
/// @return  exit code: 0 the run ended as asked, 1 it ended on a fault
/// @throws  ConfigError, also where the file has no section `plant`; std::runtime_error where the report
/// cannot be
///          written, or the simulated body cannot be advanced
/// Real-time: no.
int simulate(const Config& config, const SimulationOptions& options);

}  // namespace tendril::app
