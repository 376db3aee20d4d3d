// SPDX-License-Identifier: Apache-2.0
#include "rt/thread.h"

#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <stdexcept>

#include "rt/memory.h"
#include "rt/page_faults.h"
#include "rt/rt_error.h"
#include "tests/rt/child_process.h"

namespace tendril::rt::thread_test {

ThreadConfig named(const std::string& name) {
  ThreadConfig config;
  config.name = name;
  return config;
}

int last_allowed_cpu() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  REQUIRE(sched_getaffinity(0, sizeof allowed, &allowed) == 0);
  int last = -1;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
    if (CPU_ISSET(cpu, &allowed)) last = cpu;
  return last;
}

TEST_CASE("RealtimeThread runs its body under SCHED_FIFO at the priority asked for", "[rt]") {
  Scheduling scheduling;
  ThreadConfig config = named("control");
  config.priority = 37;
  RealtimeThread thread(config, RtRights::kIgnore, [&] { scheduling = scheduling_of_this_thread(); });
  thread.join();
  if (!thread.refusal().empty()) {
    CHECK(scheduling.policy == "SCHED_OTHER");
    WARN("skipped: " << thread.refusal());
    return;
  }
  CHECK(scheduling.policy == "SCHED_FIFO");
  CHECK(scheduling.priority == 37);
}

TEST_CASE("RealtimeThread runs its body on the CPU and under the name asked for", "[rt]") {
  ThreadConfig config = named("fifteen-letters");
  config.cpu = last_allowed_cpu();
  int cpu = -1;
  char name[16] = "";
  RealtimeThread(config, RtRights::kIgnore, [&] {
    cpu = sched_getcpu();
    pthread_getname_np(pthread_self(), name, sizeof name);
  }).join();
  CHECK(cpu == config.cpu);
  CHECK(std::string(name) == "fifteen-letters");
}

TEST_CASE("keep_to_cpu leaves a thread one CPU, and says so where that cannot be", "[rt]") {
  const int cpu = last_allowed_cpu();
  RealtimeThread(named("model"), RtRights::kIgnore, [&] {
    keep_to_cpu(pthread_self(), "model", -1);
    CHECK(last_allowed_cpu() == cpu);
    keep_to_cpu(pthread_self(), "model", cpu);
    cpu_set_t allowed;
    CHECK(sched_getaffinity(0, sizeof allowed, &allowed) == 0);
    CHECK(CPU_COUNT(&allowed) == 1);
    CHECK(CPU_ISSET(cpu, &allowed));
    CHECK_THROWS_AS(keep_to_cpu(pthread_self(), "model", 1023), RtError);
    CHECK_THROWS_WITH(keep_to_cpu(pthread_self(), "model", 1023),
                      Catch::StartsWith("cannot run thread 'model' on CPU 1023; give one that exists"));
  }).join();
}

TEST_CASE("The kernel wakes a RealtimeThread without slack, even where SCHED_FIFO is refused", "[rt]") {
  const std::string slack_ns = in_child([]() -> std::string {
    const rlimit none{0, 0};
    if (setrlimit(RLIMIT_RTPRIO, &none) != 0 || !give_up_root()) return "could not give up the right";
    int slack = -1;
    RealtimeThread(named("control"), RtRights::kIgnore, [&] { slack = prctl(PR_GET_TIMERSLACK); }).join();
    return std::to_string(slack);
  });
  CHECK(slack_ns == "1");  // ordinary threads: 50000
}

TEST_CASE("RealtimeThread refuses what cannot be, and says what can", "[unit]") {
  const auto start = [](const ThreadConfig& config) { RealtimeThread(config, RtRights::kIgnore, [] {}); };
  CHECK_THROWS_AS(start(named("")), std::invalid_argument);
  CHECK_THROWS_WITH(start(named("sixteen-letters-")), Catch::Contains("1 to 15"));
  ThreadConfig config = named("control");
  config.priority = 99;
  CHECK_THROWS_WITH(start(config), Catch::Contains("give 1 to 98"));
  config = named("control");
  config.stack_bytes = 1024;
  CHECK_THROWS_WITH(start(config), Catch::Contains("give at least 65536"));
  config = named("control");
  config.cpu = 1023;
  CHECK_THROWS_WITH(start(config), Catch::Contains("on CPU 1023"));
  config.cpu = 1024;
  CHECK_THROWS_AS(start(config), std::invalid_argument);
}

TEST_CASE("Without the right to SCHED_FIFO, RealtimeThread says what to grant", "[rt]") {
  const auto without_rights = [](RtRights rights) {
    return in_child([=]() -> std::string {
      const rlimit none{0, 0};
      if (setrlimit(RLIMIT_RTPRIO, &none) != 0 || !give_up_root()) return "could not give up the right";
      std::string policy;
      try {
        RealtimeThread thread(named("control"), rights, [&] { policy = scheduling_of_this_thread().policy; });
        thread.join();
        return policy + ": " + thread.refusal();
      } catch (const RtError& error) {
        return error.what();
      }
    });
  };
  const std::string refused = without_rights(RtRights::kRequire);
  CHECK_THAT(refused, Catch::StartsWith("cannot run thread 'control' under SCHED_FIFO at priority 80"));
  for (const char* const remedy :
       {"RLIMIT_RTPRIO is 0", "CAP_SYS_NICE", "LimitRTPRIO=80", "limits.conf", "--allow-non-rt"})
    CHECK_THAT(refused, Catch::Contains(remedy));
  CHECK(without_rights(RtRights::kIgnore) == "SCHED_OTHER: " + refused);
}

#ifndef TENDRIL_SANITIZED  // shadow memory faults too
TEST_CASE("The stack of a RealtimeThread has no page fault left in it", "[rt]") {
  int64_t faults = -1;
  RealtimeThread(named("control"), RtRights::kIgnore, [&] {
    const PageFaultCounter counter;
    prefault_stack(900 << 10);  // of 1 MiB
    faults = counter.faults().minor;
  }).join();
  CHECK(faults == 0);
}
#endif

}  // namespace tendril::rt::thread_test
