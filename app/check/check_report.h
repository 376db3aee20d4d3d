// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/config/config.h"

namespace tendril::app {

/// Everything that can be verified without a bus, printed as a table or as JSON: mesh, bus budget, the body's
/// rest, the times of a refresh and of an iteration of the QP, and how near the model comes to every
/// waypoint.
/// @return  exit code: 0 all is well, 1 something does not hold (the body finds no rest, a waypoint is out of
/// reach)
/// @throws  ConfigError
/// Real-time: no.
int check_robot(const Config& config, bool json);

}  // namespace tendril::app
