// SPDX-License-Identifier: Apache-2.0
#include "hal/protocols/drive_protocols.h"

#include <array>

#include "hal/cia402/cia402_protocol.h"
#include "hal/odrive/odrive_protocol.h"

namespace tendril::hal {

std::span<const DriveProtocol* const> drive_protocols() {
  static const std::array<const DriveProtocol*, 2> kProtocols = {&cia402_protocol(), &odrive_protocol()};
  return kProtocols;
}

}  // namespace tendril::hal
