// SPDX-License-Identifier: Apache-2.0
#include "rt/control_law.h"

#include <cstddef>

namespace tendril::rt {

const char* name(Phase phase) noexcept {
  static constexpr const char* kNames[] = {"connect", "model",   "enable",  "run",
                                           "stop",    "standby", "disable", "stopped"};
  return kNames[static_cast<std::size_t>(phase)];
}

}  // namespace tendril::rt
