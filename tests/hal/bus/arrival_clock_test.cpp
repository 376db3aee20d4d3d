// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/arrival_clock.h"

#include <catch2/catch.hpp>

using tendril::hal::ArrivalClock;

namespace {

// A realistic distance between the two clocks.
constexpr int64_t kEpoch_ns = 1'700'000'000'000'000'000;

}  // namespace

TEST_CASE("A frame that waited in the queue keeps the time of its arrival", "[unit]") {
  ArrivalClock clock(1000);
  clock.look(9000, kEpoch_ns + 9000);
  CHECK(clock.arrival_ns(kEpoch_ns + 3000) == 3000);
  CHECK(clock.arrival_ns(kEpoch_ns + 9000) == 9000);
}

TEST_CASE("A step of the real-time clock moves no arrival out of the time since the queue was empty",
          "[unit]") {
  ArrivalClock clock(1000);
  clock.look(2000, kEpoch_ns + 2000);
  clock.found_empty();
  const int64_t step_ns = GENERATE(-3'600'000'000'000, 3'600'000'000'000);
  clock.look(9000, kEpoch_ns + 9000 + step_ns);
  const int64_t arrival_ns = clock.arrival_ns(kEpoch_ns + 5000);
  CHECK(arrival_ns >= 2000);
  CHECK(arrival_ns <= 9000);
}

TEST_CASE("A frame that the kernel did not stamp counts as old, within bounds", "[unit]") {
  ArrivalClock clock(1000);
  clock.look(9000, kEpoch_ns + 9000);
  CHECK(clock.arrival_ns(0) == 1000);
}
