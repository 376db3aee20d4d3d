// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace tendril::rt {

/// As long as it lives, no CPU sleeps so deep that it takes longer than a limit to wake. The kernel's own
/// choice of idle states is for power: deep ones take 100 us and more to leave, and the control thread waits
/// for that. Of several limits on one machine the smallest holds.  [Linux, PM Quality of Service]
class IdleLatencyLimit {
 public:
  /// @param limit_us  0: CPUs do not sleep at all, at the price of power and heat
  /// @param device    where the kernel takes limits, for as long as it is open
  /// @throws RtError  where the kernel refuses; what() says what to grant
  /// Real-time: no (opens a file).
  explicit IdleLatencyLimit(int32_t limit_us, const std::string& device = "/dev/cpu_dma_latency");
  ~IdleLatencyLimit();
  IdleLatencyLimit(const IdleLatencyLimit&) = delete;
  IdleLatencyLimit& operator=(const IdleLatencyLimit&) = delete;

 private:
  int device_;
};

}  // namespace tendril::rt
