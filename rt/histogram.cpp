// SPDX-License-Identifier: Apache-2.0
#include "rt/histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace tendril::rt {

namespace {
constexpr int kHalfBits = 9;
constexpr int kHalf = 1 << kHalfBits;  // buckets a doubling; 512 ns is where the first such doubling begins
static_assert(kHalf * (std::bit_width(static_cast<uint64_t>(Histogram::kHighestNs)) - kHalfBits + 1) ==
              Histogram::kBuckets);
}  // namespace

// Index i = shift · 512 + (value >> shift), where shift is 0 below 1024 ns and else leaves 10 bits of the
// value, so that value >> shift is 512 to 1023. The first 512 buckets hold values below 512, the next 512
// those below 1024, and each further 512 one doubling.
int Histogram::index_of(int64_t value_ns) noexcept {
  const auto value = static_cast<uint64_t>(value_ns);
  const int shift = std::max(0, static_cast<int>(std::bit_width(value)) - (kHalfBits + 1));
  return shift * kHalf + static_cast<int>(value >> shift);
}

Histogram::Bucket Histogram::bucket(int index) const noexcept {
  const int shift = std::max(0, index / kHalf - 1);
  const int64_t low_ns = static_cast<int64_t>(index - shift * kHalf) << shift;
  const int64_t width_ns = int64_t{1} << shift;
  return {low_ns, low_ns + width_ns - 1, counts_[static_cast<std::size_t>(index)]};
}

void Histogram::record(int64_t value_ns) noexcept {
  const int64_t value = std::clamp<int64_t>(value_ns, 0, kHighestNs);
  ++counts_[static_cast<std::size_t>(index_of(value))];
  ++count_;
  sum_ns_ += value;
  min_ns_ = std::min(min_ns_, value);
  max_ns_ = std::max(max_ns_, value);
}

void Histogram::record_with_missed(int64_t value_ns, int64_t period_ns) noexcept {
  record(value_ns);
  if (period_ns < 1) return;
  int64_t missed_ns = std::clamp<int64_t>(value_ns, 0, kHighestNs) - period_ns;
  for (int step = 0; step < kMissedCap && missed_ns > 0; ++step, missed_ns -= period_ns) record(missed_ns);
}

void Histogram::merge(const Histogram& other) noexcept {
  for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += other.counts_[i];
  count_ += other.count_;
  sum_ns_ += other.sum_ns_;
  min_ns_ = std::min(min_ns_, other.min_ns_);
  max_ns_ = std::max(max_ns_, other.max_ns_);
}

void Histogram::clear() noexcept {
  // Not *this = Histogram(): that would build 104 KiB on the stack of the control thread.
  counts_.fill(0);
  count_ = sum_ns_ = max_ns_ = 0;
  min_ns_ = kHighestNs;
}

double Histogram::mean_ns() const noexcept {
  return count_ > 0 ? static_cast<double>(sum_ns_) / static_cast<double>(count_) : 0;
}

int64_t Histogram::percentile_ns(double p) const noexcept {
  if (count_ == 0) return 0;
  // 99.9 has no exact double: without the last factor, 99.9 % of 1000 values could come out just above 999
  // and be rounded up to all of them.
  const double rank = std::clamp(p, 0.0, 100.0) / 100 * static_cast<double>(count_) * (1 - 1e-12);
  const auto wanted = std::max<int64_t>(1, static_cast<int64_t>(std::ceil(rank)));
  int64_t seen = 0;
  for (int i = 0; i < kBuckets; ++i) {
    seen += counts_[static_cast<std::size_t>(i)];
    if (seen >= wanted) return std::clamp(bucket(i).high_ns, min_ns_, max_ns_);
  }
  return max_ns_;
}

}  // namespace tendril::rt
