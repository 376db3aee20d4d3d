// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "app/config/config.h"
#include "app/virtual_time/virtual_rig.h"

namespace tendril::tools {

/// The model's loop, and how control depends on it: by itself (two loops, asynchronous), or as a part of it
/// (one loop, the generic method of the paper).
struct Loops {
  double model_rate_hz = 15;
  bool synchronous = false;
  double jitter = 0;  ///< of the model's periods, see app::VirtualSettings
  fem::Tangent tangent = fem::Tangent::kExact;

  app::VirtualSettings settings() const {
    return {.model_rate_hz = model_rate_hz, .model_jitter = jitter, .synchronous = synchronous};
  }
};

}  // namespace tendril::tools
