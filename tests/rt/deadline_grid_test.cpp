// SPDX-License-Identifier: Apache-2.0
#include "rt/deadline_grid.h"

#include <catch2/catch.hpp>
#include <limits>
#include <random>
#include <stdexcept>

namespace tendril::rt::deadline_grid_test {

constexpr int64_t kSecond = 1'000'000'000;
constexpr int64_t kStart = 123'456'789'012'345;  // a machine that has been up for a day and a half
TEST_CASE("DeadlineGrid at 600 Hz does not drift in an hour, nor in a year", "[unit]") {
  const DeadlineGrid grid(600, kStart);
  CHECK(grid.deadline_ns(0) == kStart);
  for (const int64_t seconds : {int64_t{1}, int64_t{3600}, int64_t{365 * 24 * 3600}}) {
    CHECK(grid.deadline_ns(600 * seconds) - kStart == seconds * kSecond);
    CHECK(grid.deadline_ns(600 * seconds + 1) - kStart == seconds * kSecond + 1'666'667);
  }
  // What adding up the rounded period would give: 0.72 ms late after an hour.
  CHECK(600 * 3600 * grid.period_ns() - 3600 * kSecond == 720'000);
}

TEST_CASE("DeadlineGrid rounds each deadline to the nearest nanosecond", "[unit]") {
  const DeadlineGrid grid(600, kStart);
  CHECK(grid.deadline_ns(1) - kStart == 1'666'667);
  CHECK(grid.deadline_ns(2) - kStart == 3'333'333);
  CHECK(grid.deadline_ns(3) - kStart == 5'000'000);
}

TEST_CASE("DeadlineGrid finds the first deadline that is not past", "[unit]") {
  const DeadlineGrid grid(600, kStart);
  CHECK(grid.first_at_or_after(0) == 0);
  CHECK(grid.first_at_or_after(kStart) == 0);
  CHECK(grid.first_at_or_after(kStart + 1) == 1);
  const uint64_t seed = 5;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (const double rate_hz : {0.001, 1.0, 59.94, 600.0, 1000.0, 1e6 / 3, 1e6}) {
    CAPTURE(rate_hz);
    const DeadlineGrid any(rate_hz, kStart);
    for (int i = 0; i < 2000; ++i) {
      const auto k = static_cast<int64_t>(random() % 1'000'000);
      REQUIRE(any.first_at_or_after(any.deadline_ns(k)) == k);
      REQUIRE(any.first_at_or_after(any.deadline_ns(k) + 1) == k + 1);
    }
  }
}

TEST_CASE("DeadlineGrid refuses a rate that is no rate", "[unit]") {
  for (const double rate_hz :
       {0.0, -600.0, 2e6, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    CHECK_THROWS_AS(DeadlineGrid(rate_hz, 0), std::invalid_argument);
  CHECK_THROWS_WITH(DeadlineGrid(0, 0), Catch::Contains("0.001 to 1000000 Hz"));
}

}  // namespace tendril::rt::deadline_grid_test
