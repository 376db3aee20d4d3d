// SPDX-License-Identifier: Apache-2.0
#include "rt/histogram.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "rt/periodic_clock.h"

namespace tendril::rt::histogram_test {

// The definition: the least value that at least p percent of all do not exceed, in whole per-mille steps of
// p.
int64_t exact_percentile(const std::vector<int64_t>& sorted, int64_t per_mille) {
  const auto n = static_cast<int64_t>(sorted.size());
  const int64_t rank = std::max<int64_t>(1, (per_mille * n + 999) / 1000);
  return sorted[static_cast<std::size_t>(rank - 1)];
}

std::vector<int64_t> latencies(std::size_t count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> exponent(2, 10);  // 100 ns to 10 s
  std::vector<int64_t> values(count);
  for (int64_t& value : values) value = std::llround(std::pow(10, exponent(random)));
  return values;
}

TEST_CASE("Histogram percentiles are at most 1/512 above the exact ones and never below", "[unit]") {
  const auto seed = GENERATE(1u, 2u, 3u);
  const auto count =
      GENERATE(std::size_t{1}, std::size_t{10}, std::size_t{999}, std::size_t{1000}, std::size_t{100'000});
  CAPTURE(seed, count);
  std::vector<int64_t> values = latencies(count, seed);
  const auto histogram = std::make_unique<Histogram>();
  for (const int64_t value : values) histogram->record(value);
  std::sort(values.begin(), values.end());
  for (const int64_t per_mille : {0, 1, 10, 250, 500, 900, 990, 998, 999, 1000}) {
    CAPTURE(per_mille);
    const int64_t exact = exact_percentile(values, per_mille);
    const int64_t reported = histogram->percentile_ns(static_cast<double>(per_mille) / 10);
    CHECK(reported >= exact);
    CHECK(reported <= exact + exact / 512);
  }
  CHECK(histogram->count() == static_cast<int64_t>(count));
  CHECK(histogram->min_ns() == values.front());
  CHECK(histogram->max_ns() == values.back());
  CHECK(histogram->percentile_ns(100) == values.back());
  double sum = 0;
  for (const int64_t value : values) sum += static_cast<double>(value);
  CHECK(histogram->mean_ns() == Approx(sum / static_cast<double>(count)).epsilon(1e-12));
}

TEST_CASE("Histogram buckets tile the durations from 0 to the highest", "[unit]") {
  const auto histogram = std::make_unique<Histogram>();
  int64_t next = 0;
  for (int i = 0; i < Histogram::kBuckets; ++i) {
    const Histogram::Bucket bucket = histogram->bucket(i);
    REQUIRE(bucket.low_ns == next);
    REQUIRE(bucket.high_ns - bucket.low_ns <= bucket.low_ns / 512);
    histogram->record(bucket.low_ns);
    histogram->record(bucket.high_ns);
    REQUIRE(histogram->bucket(i).count == 2);
    next = bucket.high_ns + 1;
  }
  CHECK(next == Histogram::kHighestNs + 1);
}

TEST_CASE("Histogram takes values out of its range as its ends", "[unit]") {
  const auto histogram = std::make_unique<Histogram>();
  histogram->record(INT64_MIN);
  histogram->record(INT64_MAX);
  CHECK(histogram->min_ns() == 0);
  CHECK(histogram->max_ns() == Histogram::kHighestNs);
  CHECK(histogram->count() == 2);
  histogram->record_with_missed(INT64_MIN, 1000);
  CHECK(histogram->count() == 3);
  histogram->record_with_missed(INT64_MAX, 1);
  CHECK(histogram->count() == 4 + Histogram::kMissedCap);
}

TEST_CASE("Histogram without values reports zeros", "[unit]") {
  const auto histogram = std::make_unique<Histogram>();
  CHECK(histogram->percentile_ns(50) == 0);
  CHECK(histogram->min_ns() == 0);
  CHECK(histogram->max_ns() == 0);
  CHECK(histogram->mean_ns() == 0);
}

TEST_CASE("Merged histograms are the histogram of all values", "[unit]") {
  const auto all = std::make_unique<Histogram>(), one = std::make_unique<Histogram>(),
             other = std::make_unique<Histogram>();
  for (const int64_t value : latencies(1000, 1)) all->record(value), one->record(value);
  for (const int64_t value : latencies(500, 2)) all->record(value), other->record(value);
  one->merge(*other);
  CHECK(one->count() == 1500);
  CHECK(one->min_ns() == all->min_ns());
  CHECK(one->max_ns() == all->max_ns());
  CHECK(one->mean_ns() == all->mean_ns());
  for (int i = 0; i < Histogram::kBuckets; ++i) REQUIRE(one->bucket(i).count == all->bucket(i).count);

  one->clear();
  CHECK(one->count() == 0);
  one->merge(*other);
  CHECK(one->min_ns() == other->min_ns());
  CHECK(one->mean_ns() == other->mean_ns());
}

TEST_CASE("A stall counts for every wake-up that it swallowed", "[unit]") {
  const auto histogram = std::make_unique<Histogram>();
  histogram->record_with_missed(350, 100);
  CHECK(histogram->count() == 4);
  for (const int value : {350, 250, 150, 50}) CHECK(histogram->bucket(value).count == 1);

  histogram->clear();
  histogram->record_with_missed(300, 100);  // the wake-up at 300 was met
  CHECK(histogram->count() == 3);

  // 999 good cycles and one stall of a thousand periods: the median of all deadlines is half the stall.
  histogram->clear();
  for (int cycle = 0; cycle < 999; ++cycle) histogram->record(1000);
  histogram->record_with_missed(1'000'000'000, 1'000'000);
  CHECK(histogram->percentile_ns(75) == Approx(500e6).epsilon(0.01));
}

TEST_CASE("A loop that follows the recipe counts every deadline exactly once", "[unit]") {
  const uint64_t seed = 11;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  const auto up_to = [&](int64_t limit) { return static_cast<int64_t>(random()) & (limit - 1); };
  const auto histogram = std::make_unique<Histogram>();
  PeriodicClock clock(1000, 0);  // so long ago that wait() never sleeps
  const DeadlineGrid grid(1000, 0);
  int64_t time_ns = 0, missed = 0, cycles = 0;
  for (; cycles < 10'000; ++cycles) {
    const int64_t intended_ns = clock.wait();
    time_ns = std::max(time_ns, intended_ns) + up_to(1 << 14);
    if (random() % 100 == 0) time_ns += up_to(1 << 24);  // woken late, by up to 17 periods
    histogram->record(time_ns - intended_ns);
    time_ns += up_to(1 << 19);
    if (random() % 100 == 0) time_ns += up_to(1 << 24);  // a cycle that takes long
    if (const int64_t late_ns = time_ns - clock.next_deadline_ns(); late_ns > 0)
      histogram->record_with_missed(late_ns, clock.period_ns());
    missed += clock.realign(time_ns);
  }
  CHECK(missed > 0);
  CHECK(histogram->count() == cycles + missed);
  CHECK(clock.next_deadline_ns() == grid.deadline_ns(1 + histogram->count()));
}

}  // namespace tendril::rt::histogram_test
