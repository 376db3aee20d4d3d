// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hal/drive/master_config.h"

namespace tendril::hal {

/// Checks the configuration of CiA 402 drives: ranges, and that no two senders share an identifier.
/// @throws SettingError; std::invalid_argument with a sentence where no single setting is wrong
/// Real-time: no.
void check_cia402(const MasterConfig& config);

}  // namespace tendril::hal
