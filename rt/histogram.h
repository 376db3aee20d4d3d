// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace tendril::rt {

/// A histogram of durations, made for latencies: recording is a few instructions and never allocates, and the
/// value of every percentile is known to within 0.2 % from 1 ns to 17 s.
///
/// Buckets are 1 ns wide up to 1024 ns; above, each doubling of the duration is cut into 512 equal ones, as
/// in G. Tene's HdrHistogram. A plain value: copies, travels through a TripleBuffer; 104 KiB, so mind the
/// stack.
///
/// How a control loop counts every deadline exactly once, those it slept through included: a cycle that
/// begins calls record(wake_up − intended); a cycle that ends late calls record_with_missed(end − next
/// deadline, period) before it realigns, for the deadlines that it is about to skip.
class Histogram {
 public:
  static constexpr int64_t kHighestNs = (int64_t{1} << 34) - 1;  // 17.2 s
  static constexpr int kBuckets = 26 * 512;  // below 512 ns, and the 25 doublings from there to kHighestNs
  static constexpr int kMissedCap = 1 << 16;

  /// Adds one duration.
  /// @param value_ns  below 0 counts as 0, above kHighestNs as kHighestNs
  /// Real-time: wait-free, one thread.
  void record(int64_t value_ns) noexcept;

  /// Adds the latency of a wake-up and those of the wake-ups that should have come during it: value, value −
  /// period, value − 2 period, … while above 0. Otherwise a stall of a hundred periods would weigh as one bad
  /// cycle in hundred and not as a hundred ("coordinated omission", G. Tene).
  /// @param value_ns   as for record()
  /// @param period_ns  of the loop; below 1: only the value itself is added
  /// Real-time: wait-free, one thread; at most kMissedCap steps.
  void record_with_missed(int64_t value_ns, int64_t period_ns) noexcept;

  /// Adds all that another histogram holds.
  /// Real-time: wait-free, one thread; kBuckets steps.
  void merge(const Histogram& other) noexcept;

  /// Forgets everything.
  /// Real-time: wait-free, one thread; kBuckets steps.
  void clear() noexcept;

  /// How many durations it holds.
  int64_t count() const noexcept { return count_; }

  /// The least and the greatest duration, exact, ns; 0 where there is none.
  int64_t min_ns() const noexcept { return count_ > 0 ? min_ns_ : 0; }
  int64_t max_ns() const noexcept { return max_ns_; }

  /// The mean of the durations, exact but for rounding, ns; 0 where there is none.
  double mean_ns() const noexcept;

  /// The least recorded duration that is not exceeded by p percent of them (nearest rank).
  /// @param p  percent, 0 to 100, e.g. 99.9; values outside count as the nearer end
  /// @return   ns, never below the exact value, above it by 1/512 of it at the most; 100 gives max_ns(); 0
  /// where
  ///           there is none
  /// Real-time: wait-free; kBuckets steps.
  int64_t percentile_ns(double p) const noexcept;

  /// One bucket, for plots: the durations it covers, both ends included, and how many of them there were.
  struct Bucket {
    int64_t low_ns = 0, high_ns = 0, count = 0;
  };

  /// @param index  0 to kBuckets − 1, by growing duration
  Bucket bucket(int index) const noexcept;

 private:
  static int index_of(int64_t value_ns) noexcept;

  std::array<int64_t, kBuckets> counts_{};
  int64_t count_ = 0;
  int64_t sum_ns_ = 0;
  int64_t min_ns_ = kHighestNs;
  int64_t max_ns_ = 0;
};

}  // namespace tendril::rt
