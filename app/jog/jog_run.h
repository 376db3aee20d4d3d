// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/jog/jog_options.h"

namespace tendril::app {

/// Moves one axis over the bus as its only master, and tells how it goes.
/// @return  0 arrived; 1 ended otherwise
/// @throws ConfigError for a wrong option or file; BusError, rt::RtError
int run_jog(const JogOptions& options);

}  // namespace tendril::app
