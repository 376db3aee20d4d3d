// SPDX-License-Identifier: Apache-2.0

#include <catch2/catch.hpp>
#include <stdexcept>

#include "tools/tendril_latency_stages.h"

namespace tendril::tools::latency_stages_test {

constexpr int64_t kPeriod_ns = 1'000'000;

rt::TraceRecord cycle(int64_t wakeup_ns, int64_t read_ns, int64_t solve_ns, int64_t work_ns,
                      int64_t missed = 0) {
  rt::TraceRecord record;
  record.wakeup_ns = wakeup_ns;
  record.read_ns = read_ns;
  record.solve_ns = solve_ns;
  record.cycle_ns = work_ns;
  record.missed = missed;
  return record;
}

TEST_CASE("The stages of a cycle sum up to the whole, from the intended wake-up on", "[unit]") {
  LatencyStages stages(kPeriod_ns);
  stages.add(cycle(50'000, 10'000, 3'000, 40'000));
  CHECK(stages.stage("wakeup").max_ns() == 50'000);
  CHECK(stages.stage("read").max_ns() == 10'000);
  CHECK(stages.stage("solve").max_ns() == 3'000);
  CHECK(stages.stage("write").max_ns() == 27'000);
  CHECK(stages.stage("whole").max_ns() == 90'000);
  CHECK(stages.cycles() == 1);
  CHECK(stages.late() == 0);
}

TEST_CASE("A cycle that stalls for k periods counts k times, in the wake-up and in the whole", "[law]") {
  const bool stalls_in_work = GENERATE(false, true);
  CAPTURE(stalls_in_work);
  LatencyStages stages(kPeriod_ns);
  for (int k = 0; k < 90; ++k) stages.add(cycle(1'000, 1'000, 1'000, 5'000));
  const int64_t stall_ns = 10 * kPeriod_ns + 500'000;
  stages.add(stalls_in_work ? cycle(0, 0, 0, stall_ns, 10) : cycle(stall_ns, 0, 0, 0, 10));

  CHECK(stages.cycles() == 101);
  CHECK(stages.late() == 10);
  // 10.5, 9.5, ... 0.5 ms: the cycle that stalled and the ten deadlines that passed meanwhile.
  for (const char* name : {"wakeup", "whole"}) {
    const rt::Histogram& stage = stages.stage(name);
    CAPTURE(name);
    CHECK(stage.count() == stages.cycles());
    int64_t long_ones = 0;
    for (int i = 0; i < rt::Histogram::kBuckets; ++i)
      if (stage.bucket(i).low_ns > 400'000) long_ones += stage.bucket(i).count;
    CHECK(long_ones ==
          (stalls_in_work && stage.min_ns() == 0 ? 10 : 11));  // who stalls in its work woke in time
  }
}

TEST_CASE("The bare timer has a wake-up and nothing to read, solve or write", "[unit]") {
  LatencyStages stages(kPeriod_ns);
  stages.add(cycle(50'000, 0, 0, 0));
  CHECK(stages.stage("read").count() == 0);
  CHECK(stages.json().contains("wakeup"));
  CHECK_FALSE(stages.json().contains("solve"));
  CHECK(stages.table().find("solve") == std::string::npos);
}

TEST_CASE("Plot and JSON of the stages hold every cycle", "[unit]") {
  LatencyStages stages(kPeriod_ns);
  for (int k = 0; k < 1000; ++k) stages.add(cycle(1'000 * (k + 1) + 500, 1'000, 1'000, 5'000));
  int64_t in_json = 0;
  const auto json = stages.json();
  for (const auto& bucket : json["wakeup"]["buckets"]) in_json += bucket[2].get<int64_t>();
  CHECK(in_json == 1000);
  CHECK(json["wakeup"]["max_us"] == 1000.5);

  // 1.5 us in the row from 1 us, then 2.5 to 4.5, 5.5 to 9.5, 10.5 to 19.5, ... and 1000.5.
  const std::string plot = stages.plot("wakeup");
  for (const char* row :
       {"        1 |", "        2 |", "        5 |", "       10 |", "      500 |", "     1000 |"})
    CHECK(plot.find(row) != std::string::npos);
  CHECK(plot.find(" 10\n") != std::string::npos);
  CHECK(plot.find(" 500\n") != std::string::npos);
}

TEST_CASE("A stage that does not exist is refused by name", "[unit]") {
  CHECK_THROWS_WITH(LatencyStages(kPeriod_ns).stage("sleep"), Catch::Contains("sleep"));
}

}  // namespace tendril::tools::latency_stages_test
