// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>

namespace tendril::app {

/// Time that the calling thread has been on a CPU, s. Real-time: one system call.
inline double cpu_seconds() noexcept {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace tendril::app
