// SPDX-License-Identifier: Apache-2.0
#include "app/robot/inverse_statics.h"

#include <catch2/catch.hpp>
#include <memory>

#include "app/config/load_config.h"
#include "app/robot/motion.h"

// Where the model's effectors come to rest when the QP and the model take turns.

namespace tendril::app::inverse_statics_test {

constexpr double kReached_m = 1e-6, kBeside_m = 3e-5;

TEST_CASE("The diamond's tip comes to a waypoint within a micrometre, and stays beside it for an energy term",
          "[scenario]") {
  Config config = load_config(std::string(TENDRIL_SOURCE_DIR) + "/config/diamond.yaml");
  REQUIRE(config.control.epsilon == 0);
  const auto robot = build_model(config);
  const rt::EffectorVector at_rest = effectors_at_rest(*robot);
  for (const Eigen::Vector3d& waypoint : config.motion->waypoints) {
    const rt::EffectorVector goal = goal_at(config, waypoint, at_rest);
    const auto miss = [&](double epsilon) {
      config.control.epsilon = epsilon;
      const StaticSolution result = solve_inverse_statics(*robot, config, goal);
      REQUIRE(result.converged);
      return (result.p_e - goal).norm();
    };
    CAPTURE(waypoint.transpose());
    CHECK(miss(0) < kReached_m);
    CHECK(miss(1e-3) > kBeside_m);
  }
}

}  // namespace tendril::app::inverse_statics_test
