// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hal/drive/drive_protocol.h"

namespace tendril::hal {

/// ODrive's CANSimple; `bus.protocol: odrive` in a robot file.
const DriveProtocol& odrive_protocol();

}  // namespace tendril::hal
