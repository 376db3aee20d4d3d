// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/deadline_grid.h"

namespace tendril::rt {

/// The time of CLOCK_MONOTONIC in ns, the only clock of the project.
/// Real-time: wait-free, any thread.
int64_t now_ns() noexcept;

/// Wakes a thread at the deadlines of a grid.
///
///     PeriodicClock clock(600);
///     while (running) {
///       const int64_t intended_ns = clock.wait();
///       ...
///       const int64_t missed = clock.realign(now_ns());  // 0 where the cycle was in time
///     }
///
/// Without realign() a late thread would run the cycles it owes back to back, and command the robot with
/// measurements that are microseconds apart. With it the thread skips them and stays on its grid.
class PeriodicClock {
 public:
  /// @param rate_hz   see DeadlineGrid
  /// @param start_ns  CLOCK_MONOTONIC; the first wait() ends one period later
  /// @throws std::invalid_argument  where the rate is out of range
  /// Real-time: no (throws).
  explicit PeriodicClock(double rate_hz, int64_t start_ns = now_ns());

  /// Sleeps until the next deadline and returns it: the intended wake-up, from which latency is measured.
  /// Returns at once where that deadline has passed.
  /// Real-time: sleeps, takes no lock; one thread.
  int64_t wait() noexcept;

  /// Ends a cycle: where the next deadline has passed, moves on to the first one that has not.
  /// @param time_ns  the end of the cycle
  /// @return  how many deadlines were skipped; 0 where the cycle was in time
  /// Real-time: wait-free, one thread.
  int64_t realign(int64_t time_ns) noexcept;

  /// The deadline that the next wait() sleeps to.
  /// Real-time: wait-free, one thread.
  int64_t next_deadline_ns() const noexcept { return grid_.deadline_ns(next_); }

  /// The period to the nearest nanosecond.
  /// Real-time: wait-free, any thread.
  int64_t period_ns() const noexcept { return grid_.period_ns(); }

 private:
  DeadlineGrid grid_;
  int64_t next_ = 1;
};

}  // namespace tendril::rt
