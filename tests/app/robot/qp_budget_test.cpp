// SPDX-License-Identifier: Apache-2.0
#include "app/robot/qp_budget.h"

#include <catch2/catch.hpp>

#include "app/robot/model_refresher.h"
#include "qp/solver.h"
#include "tests/app/robot/block.h"

// The iteration cap of the QP: what a quarter of the cycle has time for.

namespace tendril::app::qp_budget_test {

TEST_CASE("The cap is what fits into a quarter of the cycle, and 16 an actuator where more would", "[unit]") {
  const Config config = block_at(500);
  CHECK(judge_qp(config, 10.1e-6).cap == 49);
  CHECK(judge_qp(config, 20.8e-6).cap == 24);
  CHECK(judge_qp(config, 1e-6).cap == 64);
  CHECK(judge_qp(config, 1e-12).cap == 64);
  CHECK(judge_qp(config, 0.39999e-6).text ==
        "an iteration costs 0.4 us here; 1250 fit into a quarter of the 2000 us cycle; cap 64, at most " +
            std::to_string(std::lround(1e-3 * qp::worst_case_operations(4, 4, 64))) +
            " thousand floating-point operations");
}

TEST_CASE(
    "A cycle too short for the iterations of a solve from nothing is refused with the rate that would do",
    "[unit]") {
  const Config config = block_at(500);
  CHECK_NOTHROW(judge_qp(config, 20.8e-6));
  CHECK_THROWS_WITH(
      judge_qp(config, 40e-6),
      Catch::Contains(config.file.string()) &&
          Catch::Contains("control.rate: found 500 Hz, expected at most 260 Hz for 4 actuators") &&
          Catch::Contains("the QP needs 24 iterations") && Catch::Contains("fewer actuators"));
}

TEST_CASE("A cap of the file is kept, and said to be too high where it does not fit", "[unit]") {
  Config config = block_at(500);
  config.control.iteration_cap = 10;
  CHECK(judge_qp(config, 40e-6).cap == 10);
  CHECK_THAT(judge_qp(config, 40e-6).text, !Catch::Contains("more than fit"));
  config.control.iteration_cap = 200;
  CHECK(judge_qp(config, 40e-6).cap == 200);
  CHECK_THAT(judge_qp(config, 40e-6).text, Catch::Contains(": more than fit, lower control.iteration_cap"));
}

TEST_CASE("Without a cap in the file the controller has 16 iterations an actuator, whatever the machine",
          "[unit]") {
  CHECK(controller_config(block_at(500)).iteration_cap == 64);
}

TEST_CASE("The time of an iteration is found at rest, and where the body finds no rest", "[unit]") {
  Block block;
  CHECK(time_iteration(*build_model(block.config), block.config) > 0);
  block.config.material.mass = 1e3;
  const auto heavy = build_model(block.config);
  REQUIRE_FALSE(ModelRefresher(*heavy, block.config).settle(Eigen::VectorXd::Zero(4)));
  CHECK(time_iteration(*heavy, block.config) > 0);
}

}  // namespace tendril::app::qp_budget_test
