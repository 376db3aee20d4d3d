// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/config/config.h"
#include "app/daemon/daemon_options.h"

namespace tendril::app {

/// Runs a robot from the first frame on the bus to disabled drives. Ends on SIGTERM or SIGINT, after the
/// given time, or on a fault of those that stop.
/// @return  exit code: 0 the run ended as asked, 1 it ended on a fault
/// @throws  ConfigError; rt::RtError where real-time rights are missing; hal::BusError where the bus cannot
/// be opened Real-time: no; it starts the control thread, which is.
int run_daemon(const Config& config, const DaemonOptions& options);

}  // namespace tendril::app
