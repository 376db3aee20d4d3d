// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

namespace tendril::hal {

/// Turns a kernel's stamps of arrival, which are of CLOCK_REALTIME, into CLOCK_MONOTONIC. A step of the
/// real-time clock, or a pause between the readings of the two, cannot lead far astray: whatever is in a
/// queue arrived after that was last found empty, and before now. Private to hal. Real-time: yes.
class ArrivalClock {
 public:
  /// @param now_ns  CLOCK_MONOTONIC; nothing has arrived yet
  explicit ArrivalClock(int64_t now_ns) noexcept : monotonic_ns_(now_ns), emptied_ns_(now_ns) {}

  /// What the clocks show right before the queue is read.
  void look(int64_t monotonic_ns, int64_t realtime_ns) noexcept {
    monotonic_ns_ = monotonic_ns;
    realtime_ns_ = realtime_ns;
  }

  /// The queue that was read after `look` is empty now.
  void found_empty() noexcept { emptied_ns_ = monotonic_ns_; }

  /// @param stamp_ns  CLOCK_REALTIME, as the kernel stamped a frame that was read after `look`
  /// @return          its arrival, CLOCK_MONOTONIC
  int64_t arrival_ns(int64_t stamp_ns) const noexcept {
    return std::clamp(monotonic_ns_ - (realtime_ns_ - stamp_ns), emptied_ns_, monotonic_ns_);
  }

 private:
  int64_t monotonic_ns_, realtime_ns_ = 0, emptied_ns_;
};

}  // namespace tendril::hal
