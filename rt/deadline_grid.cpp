// SPDX-License-Identifier: Apache-2.0
#include "rt/deadline_grid.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tendril::rt {

namespace {
// long double has 64 bits of mantissa on x86-64 and 113 on ARM, where double's 53 would put the deadlines of
// a long run on a grid of several nanoseconds.
constexpr long double kNsPerSecond = 1e9L;
}  // namespace

DeadlineGrid::DeadlineGrid(double rate_hz, int64_t start_ns) : rate_hz_(rate_hz), start_ns_(start_ns) {
  // Written so that not-a-number fails too.
  if (!(rate_hz >= kLowestRateHz && rate_hz <= kHighestRateHz))
    throw std::invalid_argument("a periodic task cannot run at " + std::to_string(rate_hz) +
                                " Hz; give a rate from 0.001 to 1000000 Hz");
}

int64_t DeadlineGrid::deadline_ns(int64_t k) const noexcept {
  return start_ns_ + std::llround(static_cast<long double>(k) * kNsPerSecond / rate_hz_);
}

int64_t DeadlineGrid::first_at_or_after(int64_t time_ns) const noexcept {
  if (time_ns <= start_ns_) return 0;
  const auto since_start = static_cast<long double>(time_ns - start_ns_);
  // Deadline k lies at or before the time and k + 1 after it, up to the rounding to whole nanoseconds.
  const auto k = static_cast<int64_t>(since_start * rate_hz_ / kNsPerSecond);
  return deadline_ns(k) >= time_ns ? k : k + 1;
}

int64_t DeadlineGrid::period_ns() const noexcept {
  return std::llround(kNsPerSecond / static_cast<long double>(rate_hz_));
}

}  // namespace tendril::rt
