// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendril::app {

/// How a run goes beside its cycles.
struct RunProgress {
  uint64_t model_refreshes = 0;
  uint64_t model_failures = 0;  ///< refreshes that found no usable pose
  double model_rate_hz = 0;     ///< mean over the run
  uint64_t trace_dropped = 0;   ///< cycles of which housekeeping knows nothing
};

}  // namespace tendril::app
