// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/faults.h"

namespace tendril::app {

/// "serve", "hold target", "halt", "stop".
inline const char* name(rt::Reaction reaction) {
  switch (reaction) {
    case rt::Reaction::kServe:
      return "serve";
    case rt::Reaction::kHoldTarget:
      return "hold target";
    case rt::Reaction::kHalt:
      return "halt";
    case rt::Reaction::kStop:
      return "stop";
  }
  return "";
}

}  // namespace tendril::app
