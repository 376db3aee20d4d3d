// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/bus.h"

namespace tendril::hal {

const char* name(BusHealth health) noexcept {
  switch (health) {
    case BusHealth::kActive:
      return "error-active";
    case BusHealth::kStalled:
      return "stalled";
    case BusHealth::kPassive:
      return "error-passive";
    case BusHealth::kOff:
      return "bus-off";
    case BusHealth::kDown:
      break;
  }
  return "down";
}

}  // namespace tendril::hal
