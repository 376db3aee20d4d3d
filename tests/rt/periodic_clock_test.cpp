// SPDX-License-Identifier: Apache-2.0
#include "rt/periodic_clock.h"

#include <signal.h>
#include <sys/time.h>

#include <catch2/catch.hpp>

using namespace tendril::rt;

namespace {
volatile sig_atomic_t alarms = 0;
}

TEST_CASE("PeriodicClock wakes at consecutive deadlines of its grid and never before them", "[rt]") {
  const int64_t start_ns = now_ns();
  const DeadlineGrid grid(10'000, start_ns);
  PeriodicClock clock(10'000, start_ns);
  for (int64_t k = 1; k <= 200; ++k) {
    REQUIRE(clock.next_deadline_ns() == grid.deadline_ns(k));
    REQUIRE(clock.wait() == grid.deadline_ns(k));
    REQUIRE(now_ns() >= grid.deadline_ns(k));
  }
}

TEST_CASE("PeriodicClock sleeps on when a signal interrupts it", "[rt]") {
  struct sigaction action {};
  struct sigaction before {};
  action.sa_handler = [](int) { alarms = alarms + 1; };
  REQUIRE(sigaction(SIGALRM, &action, &before) == 0);
  const itimerval every_millisecond{{0, 1000}, {0, 1000}}, off{};
  REQUIRE(setitimer(ITIMER_REAL, &every_millisecond, nullptr) == 0);
  PeriodicClock clock(20);
  const int64_t deadline_ns = clock.wait();
  const int64_t woken_ns = now_ns();
  setitimer(ITIMER_REAL, &off, nullptr);
  sigaction(SIGALRM, &before, nullptr);
  CHECK(alarms > 0);
  CHECK(woken_ns >= deadline_ns);
}

// From here on time is only a number: the start lies in the far past and nothing sleeps.
TEST_CASE("PeriodicClock skips the deadlines of a late cycle and lands on its grid", "[unit]") {
  const DeadlineGrid grid(600, 0);
  PeriodicClock clock(600, 0);
  REQUIRE(clock.wait() == grid.deadline_ns(1));

  SECTION("a cycle that ends before or at the next deadline is in time") {
    CHECK(clock.realign(grid.deadline_ns(1) + 1) == 0);
    CHECK(clock.realign(grid.deadline_ns(2)) == 0);
    CHECK(clock.next_deadline_ns() == grid.deadline_ns(2));
  }
  SECTION("one nanosecond later it has missed one") {
    CHECK(clock.realign(grid.deadline_ns(2) + 1) == 1);
    CHECK(clock.next_deadline_ns() == grid.deadline_ns(3));
    CHECK(clock.wait() == grid.deadline_ns(3));
  }
  SECTION("a stall of seventeen and a half periods has missed seventeen") {
    CHECK(clock.realign((grid.deadline_ns(18) + grid.deadline_ns(19)) / 2) == 17);
    CHECK(clock.next_deadline_ns() == grid.deadline_ns(19));
  }
  SECTION("a stall that ends at a deadline still meets it") {
    CHECK(clock.realign(grid.deadline_ns(5)) == 3);
    CHECK(clock.next_deadline_ns() == grid.deadline_ns(5));
  }
  SECTION("asked twice, it counts once") {
    CHECK(clock.realign(grid.deadline_ns(9) + 5) == 8);
    CHECK(clock.realign(grid.deadline_ns(9) + 5) == 0);
  }
}
