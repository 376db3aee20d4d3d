// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hal/drive/drive_protocol.h"

namespace tendril::hal {

/// CiA 402 over CANopen, in cyclic synchronous position or torque mode; `bus.protocol: canopen` in a robot
/// file.
const DriveProtocol& cia402_protocol();

}  // namespace tendril::hal
