// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "app/config/plant_fault.h"
#include "app/config/plant_fault_parser.h"
#include "tests/scenario/robot_files.h"

// The loop closed by a camera, in virtual time, on bodies that are not as the model has them.

namespace tendril::app::feedback_test {

using rt::Phase;

/// A shipped robot with another body than its model's: stiffer, heavier.
/// @param stiffness, weight  times the model's
Config foreign(const std::string& name, bool feedback, double stiffness, double weight) {
  Config config = testing::shipped(name);
  config.control.feedback = feedback;
  config.plant->young_modulus = stiffness * config.material.material.young_modulus;
  config.plant->mass = weight * config.material.mass;
  return config;
}

/// Mean and largest distance of the body from where it is wanted over some seconds on the path, mm.
struct Errors {
  double mean, largest;
};
Errors errors_of(const Config& config, double seconds) {
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kRunning, 4));
  rig.run_for(1e-9 * static_cast<double>(rig.motion()->path_start_ns() - rig.now_ns()) + seconds);
  REQUIRE(rig.phase() == Phase::kRunning);
  CHECK(testing::within_limits(config, rig.trace()));
  CHECK(rig.heap_calls() == 0);
  const auto errors = testing::tracking_errors_mm(config, rig);
  return {testing::mean(errors), testing::largest(errors)};
}

TEST_CASE("Feedback makes the error on the path smaller, most where the model errs most", "[figures]") {
  // By how much at least; where little is to be gained, the body's own lag is what remains.
  const auto [name, factor] = GENERATE(
      table<std::string, double>({{"diamond", 6}, {"bender", 3}, {"trunk", 1.4}, {"platform", 1.05}}));
  const double stiffness = GENERATE(1.3, 0.7);
  const Errors open = errors_of(foreign(name, false, stiffness, 1.1), 3),
               closed = errors_of(foreign(name, true, stiffness, 1.1), 3);
  CAPTURE(name, stiffness, open.mean, open.largest, closed.mean, closed.largest);
  CHECK(closed.mean < open.mean / factor);
  CHECK(closed.largest < 1.2 * open.largest);
}

TEST_CASE("Where the robot is wanted to stay, feedback brings the body there", "[figures]") {
  Config config = foreign("diamond", true, 1.3, 1.1);
  config.motion->waypoints = {{0.008, -0.005, 0.002}};
  config.motion->closed = false;
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kRunning, 4));
  rig.run_for(4);
  const Eigen::Vector3d wanted = config.motion->origin + config.motion->waypoints[0];
  CHECK((rig.measurements().back().tip - wanted).norm() < 0.1e-3);
}

TEST_CASE("A camera that falls silent in motion moves no command faster than it may, and leaves an open loop",
          "[scenario]") {
  const Config config = foreign("finger", true, 1.3, 1.1);
  const Errors open = errors_of(foreign("finger", false, 1.3, 1.1), 4);
  VirtualRig rig(config, {});
  const auto error_mm = [&] {
    const PlantMeasurement& now = rig.measurements().back();
    return 1e3 * std::abs(now.tip.x() - rig.motion()->at(now.stamp_ns).position[0]);
  };
  REQUIRE(rig.run_until(Phase::kRunning, 4));
  rig.run_for(3);
  rig.drives().inject(parse_plant_fault("sensor camera off", config));
  rig.run_for(4);
  CHECK(rig.phase() == Phase::kRunning);
  CHECK(testing::within_limits(config, rig.trace()));
  CHECK(error_mm() < 1.5 * open.largest);
  rig.drives().inject(parse_plant_fault("clear", config));
  rig.run_for(1.5);
  CHECK(error_mm() < open.mean);
}

}  // namespace tendril::app::feedback_test
