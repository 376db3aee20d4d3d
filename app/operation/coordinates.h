// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "app/config/config.h"

namespace tendril::app {

/// Names of the controlled coordinates of all effectors, in the order of rt::EffectorVector: "tip.x" for a
/// position (m), "chamber.volume" for a cavity (m³). Real-time: no (allocates).
std::vector<std::string> coordinate_names(const Config& config);

}  // namespace tendril::app
