// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendril::rt {

/// The deadlines of a periodic task: the k-th is start + round(k · 10⁹ / rate), in ns.
/// Each is computed from k and not from the one before, so a period that is no whole number of nanoseconds
/// (600 Hz: 1 666 666.67 ns) is right on average and the grid does not drift against the clock.
class DeadlineGrid {
 public:
  static constexpr double kLowestRateHz = 1e-3, kHighestRateHz = 1e6;

  /// @param rate_hz   kLowestRateHz to kHighestRateHz
  /// @param start_ns  deadline 0, ns of the caller's clock
  /// @throws std::invalid_argument  where the rate is out of that range or not a number
  /// Real-time: no (throws).
  DeadlineGrid(double rate_hz, int64_t start_ns);

  /// The k-th deadline.
  /// @param k  0 and up
  /// @return   ns, exact for the first 1.8e10 deadlines (356 days at 600 Hz), then within 1 ns for centuries
  /// Real-time: wait-free, any thread.
  int64_t deadline_ns(int64_t k) const noexcept;

  /// The first deadline that is not in the past.
  /// @return  the smallest k ≥ 0 with deadline_ns(k) ≥ time_ns
  /// Real-time: wait-free, any thread.
  int64_t first_at_or_after(int64_t time_ns) const noexcept;

  /// The period to the nearest nanosecond, to compare with: never add it up, it would drift.
  /// Real-time: wait-free, any thread.
  int64_t period_ns() const noexcept;

 private:
  double rate_hz_;
  int64_t start_ns_;
};

}  // namespace tendril::rt
