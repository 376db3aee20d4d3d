// SPDX-License-Identifier: Apache-2.0
#include "app/check/cycle_budget.h"

#include <catch2/catch.hpp>

#include "tests/app/robot/block.h"

// What a control cycle costs, and whether there is time for it.

namespace tendril::app::cycle_budget_test {

constexpr CycleCost kCost{.read_s = 100e-6, .solve_s = 20e-6, .write_s = 80e-6};

QpBudget qp_of(int cap, double iteration_s) {
  QpBudget qp;
  qp.cap = cap;
  qp.iteration_s = iteration_s;
  return qp;
}

TEST_CASE("A cycle at worst is bus, decision and the QP's iterations up to its cap", "[unit]") {
  const CycleBudget budget = judge_cycle(block_at(500), kCost, qp_of(50, 2e-6));
  CHECK(budget.whole_s == Approx(300e-6));
  CHECK(budget.margin == Approx(0.85));
  CHECK(budget.text ==
        "read 100 us, decide 20 us and 100 us more with the QP at its cap, write 80 us: 300 of 2000 us here "
        "on a local bus, 85 % left for the wake-up");
}

TEST_CASE("A cycle that leaves the wake-up less than half of its time is advised against", "[unit]") {
  CHECK_THAT(judge_cycle(block_at(500), kCost, qp_of(390, 2e-6)).text, !Catch::Contains("little"));
  CHECK_THAT(judge_cycle(block_at(500), kCost, qp_of(410, 2e-6)).text,
             Catch::Contains("49 % left") && Catch::Contains(": little; measure it with tendril-latency"));
}

TEST_CASE("A cycle that does not fit is refused with the rate that would do", "[unit]") {
  const Config config = block_at(500);
  CHECK_NOTHROW(judge_cycle(config, kCost, qp_of(899, 2e-6)));
  CHECK_THROWS_WITH(judge_cycle(config, kCost, qp_of(1150, 2e-6)),
                    Catch::Contains(config.file.string()) &&
                        Catch::Contains("control.rate: found 500 Hz, expected at most 400 Hz") &&
                        Catch::Contains("2.5e+03 of 2000 us") && Catch::Contains("control.iteration_cap"));
}

TEST_CASE("The stages of a cycle are measured with drives that follow, whatever the kind of actuator",
          "[unit]") {
  Block block;
  hal::SensorConfig& camera = block.config.sensors[0].frame;
  camera.required = true;          // though there is no body that it could see
  camera.signals[0].offset = 1.0;  // nor can it tell the 0 that stands for none
  const auto robot = build_model(block.config);
  const CycleCost cost = time_cycle(*robot, block.config);
  // Reading takes in a frame a drive and writing hands one to each: a system call at least.
  CHECK(cost.read_s > 1e-7);
  CHECK(cost.solve_s > 0);
  CHECK(cost.write_s > 1e-7);
}

TEST_CASE("A rate at which the drives cannot be brought to follow is refused with what they say", "[unit]") {
  Block block;
  block.config.control.rate_hz = 2;  // enabling takes some cycles, and longer than it may
  block.config.bus.master.enable_timeout_ns = 500'000'000;
  block.config.bus.master.feedback_timeout_ns = 1'000'000'000;
  block.config.bus.master.heartbeat_timeout_ns = 1'500'000'000;  // three control periods
  const auto robot = build_model(block.config);
  CHECK_THROWS_WITH(time_cycle(*robot, block.config), Catch::Contains("control.rate 2 Hz: axis 0"));
}

}  // namespace tendril::app::cycle_budget_test
