// SPDX-License-Identifier: Apache-2.0
#include "rt/periodic_clock.h"

#include <algorithm>
#include <cerrno>
#include <ctime>

namespace tendril::rt {

namespace {
constexpr int64_t kNsPerS = 1'000'000'000;
}

int64_t now_ns() noexcept {
  timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return time.tv_sec * kNsPerS + time.tv_nsec;
}

PeriodicClock::PeriodicClock(double rate_hz, int64_t start_ns) : grid_(rate_hz, start_ns) {}

int64_t PeriodicClock::wait() noexcept {
  const int64_t deadline_ns = next_deadline_ns();
  const timespec deadline{.tv_sec = deadline_ns / kNsPerS, .tv_nsec = deadline_ns % kNsPerS};
  // A signal handler may interrupt the sleep. The deadline is absolute, so going back to sleep loses nothing
  // and ends at the deadline at the latest. EINTR comes back as the result: this call does not use errno.
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
  }
  ++next_;
  return deadline_ns;
}

int64_t PeriodicClock::realign(int64_t time_ns) noexcept {
  const int64_t due = next_;
  next_ = std::max(next_, grid_.first_at_or_after(time_ns));
  return next_ - due;
}

}  // namespace tendril::rt
