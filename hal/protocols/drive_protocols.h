// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "hal/drive/drive_protocol.h"

namespace tendril::hal {

/// The protocols that robot files may name, the default one first. Real-time: no.
std::span<const DriveProtocol* const> drive_protocols();

}  // namespace tendril::hal
