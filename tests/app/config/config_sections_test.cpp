// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "tests/app/config/mistake.h"
#include "tests/app/robot_file.h"

// Mistakes between the keys of one section: kinds, weights, motions.

namespace tendril::app::config_sections_test {

TEST_CASE("An actuator, an effector and a region are of one kind each", "[unit]") {
  check_mistakes({
      {"cable: [body 0 97 45 mm, guide 0 10 30 mm]",
       "push: 0 97 45 mm\n    cable: [body 0 97 45 mm, guide 0 10 30 mm]",
       "- name: north",
       {"actuators[0]: found keys 'cable' and 'push', expected one of them"}},
      {"cable: [body 0 97 45 mm, guide 0 10 30 mm]",
       "cabel: [body 0 97 45 mm, guide 0 10 30 mm]",
       "cabel",
       {"actuators[0]: unknown key 'cabel'; did you mean 'cable'?"}},
      {"    cable: [body 0 97 45 mm, guide 0 10 30 mm]\n",
       "",
       "- name: north",
       {"actuators[0]: missing a key, expected one of: cable, rod, push, cavity"}},
      {"point: 0 0 125 mm",
       "points: [0 0 125 mm]\n    cavity: chamber",
       "- name: tip",
       {"effectors[0]: found keys 'points' and 'cavity'"}},
      {"{box: [-15 -15 -40 mm, 15 15 10 mm]}",
       "{sphere: 0 0 1 mm}",
       nullptr,
       {"fixed.sphere: found '0 0 1 mm'", "the radius above 0", "four lengths"}},
      {"{box: [-15 -15 -40 mm, 15 15 10 mm]}", "{sphere: 0 0 1 0 mm}", nullptr, {"fixed.sphere"}},
  });
}

TEST_CASE("Weights are numbers, one for all controlled coordinates or one for each", "[unit]") {
  check_mistakes({
      {"coordinates: xyz",
       "coordinates: xz\n    weight: [1, 2, 3]",
       "weight",
       {"effectors[0].weight: found a list of 3", "one for each of the 2 controlled coordinates"}},
      {"coordinates: xyz",
       "coordinates: xyz\n    weight: -1",
       "weight",
       {"effectors[0].weight", "no less than 0"}},
      {"coordinates: xyz",
       "coordinates: xyz\n    weight: [1, one, 1]",
       "weight",
       {"effectors[0].weight[1]: found 'one', expected a number"}},
  });
}

TEST_CASE("The effector of a motion is one of points that the file has", "[unit]") {
  check_mistakes({
      {"  speed: 25 mm/s",
       "  speed: 25 mm/s\n  effector: knee",
       "effector: knee",
       {"motion.effector: found 'knee', expected the name of an effector"}},
  });
  std::string yaml = kGood;
  yaml.replace(yaml.find("actuators:"), 0, "  - {name: air, cavity: chamber}\n");
  yaml.replace(yaml.find("  speed: 25"), 0, "  effector: air\n");
  CHECK_THAT(error_of(RobotFile(yaml).path()),
             Catch::Contains("motion.effector: found 'air', expected an effector of points"));
}

TEST_CASE("The limits of a motion and its shape fit together", "[unit]") {
  const std::string speed = "  speed: 25 mm/s";
  check_mistakes({
      {speed,
       speed + "\n  jerk: 1 m/s^3",
       "jerk: 1",
       {"motion.jerk: found '1 m/s^3', expected an acceleration"}},
      {speed,
       speed + "\n  corners: 1 mm",
       "corners",
       {"motion.corners", "expected an acceleration beside it"}},
      {speed, speed + "\n  acceleration: 0 mm/s^2", "acceleration", {"motion.acceleration", "above 0"}},
      {speed, speed + "\n  size: 20 20 mm", "size: 20", {"motion.size", "no such key without a shape"}},
      {speed, speed + "\n  turns: 0", "turns", {"motion.turns", "1"}},
      {speed, speed + "\n  shape: circle", "motion:", {"found keys 'waypoints' and 'shape'"}},
  });
  const auto with_shape = [](const std::string& shape) {
    const std::size_t motion = kGood.find("motion:");
    return error_of(
        RobotFile(kGood.substr(0, motion) + "motion: {origin: 0 0 125 mm, speed: 20 mm/s, " + shape + "}\n")
            .path());
  };
  CHECK(with_shape("shape: circle, size: 20 20 mm") == "no error");
  CHECK(with_shape("shape: line, size: 20 0 mm, plane: yz, turns: 3") == "no error");
  CHECK(with_shape("shape: lissajous, size: 20 10 mm, frequencies: [5, 4]") == "no error");
  CHECK_THAT(with_shape("shape: circle"), Catch::Contains("motion.size: found nothing, expected the size"));
  CHECK_THAT(with_shape("shape: circle, size: 20 0 mm"), Catch::Contains("only a line may be 0 wide"));
  CHECK_THAT(with_shape("shape: circle, size: 20 20 mm, frequencies: [3, 2]"),
             Catch::Contains("only a shape lissajous has it"));
  CHECK_THAT(with_shape("shape: eight, size: 20 20 mm, closed: true"), Catch::Contains("a shape is closed"));
  CHECK_THAT(with_shape("shape: lissajous, size: 20 20 mm, frequencies: [3, 0]"),
             Catch::Contains("frequencies[1]"));
  CHECK_THAT(with_shape("shape: circle, size: 20 1000 mm"),
             Catch::Contains("motion.size: found '20 1000 mm', expected a shape in control.workspace"));
  CHECK_THAT(with_shape("shape: square, size: 1000 20 mm"), Catch::Contains("in control.workspace"));
}

}  // namespace tendril::app::config_sections_test
