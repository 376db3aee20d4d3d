// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hal/drive/drive_protocol.h"

namespace tendril::app::testing {

/// A protocol that only tests have, `bus.protocol: serial`: smart servos on a serial line. One packet of up
/// to 64 bytes commands up to twelve of them, and each answers with its position.
const hal::DriveProtocol& serial_protocol();

}  // namespace tendril::app::testing
