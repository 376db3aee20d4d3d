// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/config/config.h"

namespace tendril::app {

/// What the master of the drives must know of a robot. Real-time: no.
hal::MasterConfig master_config(const Config& config);

}  // namespace tendril::app
