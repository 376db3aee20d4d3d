// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendril::rt {

/// Page faults of one thread.
struct PageFaults {
  int64_t minor = 0;  // the page was in memory and only had to be mapped: microseconds
  int64_t major = 0;  // the page had to be read from a disk: milliseconds

  int64_t total() const noexcept { return minor + major; }
};

/// Counts the page faults of the thread that made it, from then on.
class PageFaultCounter {
 public:
  /// Real-time: as faults().
  PageFaultCounter() noexcept;

  /// The faults since construction; only the thread that made the counter may ask.
  /// Real-time: one system call, in which the kernel takes a lock of this very thread (task_lock, for a few
  /// instructions; others want it when they read the thread's files in /proc).
  PageFaults faults() const noexcept;

 private:
  PageFaults at_start_;
};

}  // namespace tendril::rt
