// SPDX-License-Identifier: Apache-2.0
// Ends a test that hangs, in every test program: it gets SIGTERM, upon which Catch2 says where it stood.
#define CATCH_CONFIG_EXTERNAL_INTERFACES
#include <catch2/catch.hpp>
#include <csignal>
#include <ctime>

#include "tests/patience.h"

namespace tendril::testing {
namespace {

class Watchdog : public Catch::TestEventListenerBase {
 public:
  using TestEventListenerBase::TestEventListenerBase;

  void testCaseStarting(const Catch::TestCaseInfo&) override {
    sigevent event{};
    event.sigev_notify = SIGEV_SIGNAL;
    event.sigev_signo = SIGTERM;
    if (timer_create(CLOCK_MONOTONIC, &event, &timer_) != 0) return;
    // What waits gives up after its patience, and says more; so this is for what computes for ever.
    itimerspec limit{};
    limit.it_value.tv_sec = static_cast<time_t>(3 * kPatience_s);
    armed_ = timer_settime(timer_, 0, &limit, nullptr) == 0;
  }
  void testCaseEnded(const Catch::TestCaseStats&) override {
    if (armed_) timer_delete(timer_);
    armed_ = false;
  }

 private:
  timer_t timer_{};
  bool armed_ = false;
};

CATCH_REGISTER_LISTENER(Watchdog)

}  // namespace
}  // namespace tendril::testing
