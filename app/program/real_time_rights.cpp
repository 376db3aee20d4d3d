// SPDX-License-Identifier: Apache-2.0
#include "app/program/real_time_rights.h"

#include <spdlog/spdlog.h>

#include <cmath>
#include <cstdint>

#include "rt/memory.h"
#include "rt/rt_error.h"

namespace tendril::app {

bool lock_memory(bool allow_non_rt) {
  try {
    rt::lock_memory();
    return true;
  } catch (const rt::RtError& error) {
    if (!allow_non_rt) throw;
    spdlog::warn("{}", error.what());
    return false;
  }
}

std::unique_ptr<rt::IdleLatencyLimit> limit_idle_latency(double limit_s) {
  try {
    return std::make_unique<rt::IdleLatencyLimit>(static_cast<int32_t>(std::lround(1e6 * limit_s)));
  } catch (const rt::RtError& error) {
    spdlog::warn("{}", error.what());
    return nullptr;
  }
}

}  // namespace tendril::app
