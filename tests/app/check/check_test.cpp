// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "tests/app/program/programs.h"
#include "tests/app/robot/block.h"

// `tendrild --check`: what it finds, for people and for machines, without a bus.

namespace tendril::app::check_test {

const std::string kConfig = std::string(TENDRIL_SOURCE_DIR) + "/config/";

nlohmann::json check(const std::string& file, int code) {
  const Ended ended = run({kDaemon, file, "--check", "--json"});
  INFO(ended.err << ended.out);
  REQUIRE(ended.code == code);
  REQUIRE(lines_of(ended.out).size() == 1);
  CHECK(ended.err.empty());
  return nlohmann::json::parse(ended.out);
}

void check_shipped(const std::string& robot, int nodes, int actuators, std::size_t waypoints) {
  const nlohmann::json result = check(kConfig + robot + ".yaml", 0);
  CHECK(result.at("robot") == robot);
  CHECK(result.at("nodes") == nodes);
  CHECK(result.at("actuators") == actuators);
  CHECK(result.at("rests") == true);
  CHECK(result.at("bus_load") > 0);
  CHECK(result.at("bus_load") < 1);
  CHECK(result.at("refresh_ms") > 0);
  CHECK(result.at("qp_iteration_us") > 0);
  CHECK(result.at("iteration_cap") >= 4 * actuators);
  CHECK(result.at("iteration_cap") <= 16 * actuators);
  CHECK(result.at("cycle_us").at("whole") < result.at("cycle_us").at("period"));
  CHECK(result.at("cycle_margin") > 0);
  REQUIRE(result.at("waypoints").size() == waypoints);
  for (const nlohmann::json& waypoint : result.at("waypoints")) {
    CHECK(waypoint.at("reached") == true);
    CHECK(waypoint.at("miss_mm") < 1);
  }
}

TEST_CASE("The finger that is shipped passes its check", "[scenario]") {
  check_shipped("finger", 342, 2, 2);
  const Ended ended = run({kDaemon, kConfig + "finger.yaml", "--check"});
  CHECK(ended.code == 0);
  CHECK_THAT(ended.out, Catch::Contains("camera at 100 Hz (tip_x, tip_y, tip_z); load_cells at 100 Hz "
                                        "(right_tension, left_tension)\n"));
  CHECK(lines_of(ended.out).back() == "all is well");
}

TEST_CASE("The diamond that is shipped passes its check", "[scenario]") {
  check_shipped("diamond", 1603, 4, 4);
}

TEST_CASE("Where nothing can draw the picture that was asked for, the check says so and leaves no file",
          "[scenario]") {
  const RobotFile file(finger());
  const std::filesystem::path picture = file.folder() / "robot.png";
  const Ended ended =
      run(without_pictures({kDaemon, file.path().string(), "--check", "--picture", picture.string()}));
  CHECK(ended.code == 3);
  CHECK_THAT(ended.err, Catch::Contains(picture.string() + " is not drawn: ") &&
                            Catch::Contains("install python3-matplotlib"));
  CHECK_FALSE(std::filesystem::exists(picture));
}

TEST_CASE("A coordinate of weight 0 is no part of what a waypoint misses", "[scenario]") {
  const RobotFile file(finger({{"    coordinates: x ", "    coordinates: xz\n    weight: [1, 0] "}}));
  const nlohmann::json result = check(file.path().string(), 0);
  CHECK(result.at("effector_dofs") == 2);
  for (const nlohmann::json& waypoint : result.at("waypoints")) CHECK(waypoint.at("miss_mm") < 0.01);
}

TEST_CASE("A workspace without the rest of the effectors fails the check, which says so", "[scenario]") {
  const RobotFile file(finger({{"waypoints: [5 0 0 mm, -5 0 0 mm]", "waypoints: [5 0 0 mm, 3 0 0 mm]"},
                               {"workspace: [-15 -5 -110 mm", "workspace: [2 -5 -110 mm"}}));
  const nlohmann::json result = check(file.path().string(), 1);
  CHECK(result.at("rests_in_workspace") == false);
  for (const nlohmann::json& waypoint : result.at("waypoints")) CHECK(waypoint.at("reached") == true);
}

TEST_CASE("A waypoint out of reach fails the check, which names it", "[scenario]") {
  const RobotFile far(
      finger({{"waypoints: [5 0 0 mm, -5 0 0 mm]", "waypoints: [5 0 0 mm, 80 0 0 mm]"},
              {"workspace: [-15 -5 -110 mm, 15 5 -90 mm]", "workspace: [-15 -5 -110 mm, 100 5 -90 mm]"}}));
  const nlohmann::json result = check(far.path().string(), 1);
  CHECK(result.at("waypoints").at(0).at("reached") == true);
  CHECK(result.at("waypoints").at(1).at("reached") == false);
  CHECK(result.at("waypoints").at(1).at("miss_mm") > 10);
  CHECK(result.at("reached_within_mm") == 1);
  // The finger cannot be bent further than the right cable pulls.
  const nlohmann::json& limit = result.at("waypoints").at(1).at("at_limits").at(0);
  CHECK(limit.at("actuator") == "right");
  CHECK(limit.at("side") == "greatest");

  const Ended ended = run({kDaemon, far.path().string(), "--check"});
  CHECK(ended.code == 1);
  CHECK_THAT(ended.out, Catch::Contains("(5.0) mm reached: ") && Catch::Contains("(1 mm counts as reached)"));
  CHECK_THAT(ended.out, Catch::Contains("waypoint 1   (80.0) mm OUT OF REACH: ") &&
                            Catch::Contains("at their limits: right (greatest ") &&
                            !Catch::Contains("other effectors"));
  CHECK(lines_of(ended.out).back() == "not all is well");
}

TEST_CASE("A waypoint without an answer fails the check without a figure, and says what is in the way",
          "[scenario]") {
  const RobotFile weak(
      finger({{"priority: 80", "priority: 80\n  iteration_cap: 1"},
              {"tension: 0.1 2 N", "tension: 0.1 200 N"},
              {"stroke: -3 6 mm", "stroke: -3 99 mm"},
              {"waypoints: [5 0 0 mm, -5 0 0 mm]", "waypoints: [90 0 0 mm]"},
              {"workspace: [-15 -5 -110 mm, 15 5 -90 mm]", "workspace: [-15 -5 -110 mm, 100 5 -90 mm]"}}));
  const nlohmann::json waypoint = check(weak.path().string(), 1).at("waypoints").at(0);
  CHECK(waypoint.at("miss_mm").is_null());
  CHECK(waypoint.at("reached") == false);
  const Ended ended = run({kDaemon, weak.path().string(), "--check"});
  CHECK_THAT(ended.out,
             Catch::Contains("(90.0) mm NOT REACHED: the QP was stopped at its cap of 1 iterations") &&
                 !Catch::Contains("inf") && !Catch::Contains("nan"));
}

TEST_CASE("The path of a robot that is shipped is followed with all actuators below their top speeds",
          "[scenario]") {
  const nlohmann::json path = check(kConfig + "finger.yaml", 0).at("path");
  CHECK(path.at("follows") == true);
  CHECK(path.at("target_to_model_mm").at("max") < 0.5);
  CHECK(path.at("round_s").get<double>() == Approx(2));
  CHECK(path.at("covered_s").get<double>() == Approx(2).margin(0.01));
  CHECK(path.at("faults").empty());
  CHECK(path.at("stop_reason") == "");
  for (const auto& [name, actuator] : path.at("actuators").items()) {
    CHECK(actuator.at("greatest_speed") > 0.1);
    CHECK(actuator.at("greatest_speed") < actuator.at("top_speed"));
    CHECK_FALSE(actuator.contains("asked_speed"));
  }
}

TEST_CASE(
    "A path that is too fast for the actuators fails the check, which says where, why and what would do",
    "[scenario]") {
  const RobotFile fast(
      finger({{"speed: 10 mm/s", "speed: 300 mm/s"}, {"top_speed: 30 mm/s", "top_speed: 10 mm/s"}}));
  const nlohmann::json path = check(fast.path().string(), 1).at("path");
  CHECK(path.at("follows") == false);
  CHECK(path.at("target_to_model_mm").at("max") > 3);
  CHECK(path.at("worst").at("t_s") > 0);
  CHECK(path.at("first_off").at("t_s") <= path.at("worst").at("t_s"));
  const nlohmann::json& right = path.at("actuators").at("right");
  CHECK(right.at("greatest_speed").get<double>() == Approx(10).epsilon(0.01));
  CHECK(right.at("asked_speed") > 20);
  CHECK(right.at("at_top_speed_s") > 0.05);
  const Ended ended = run({kDaemon, fast.path().string(), "--check"});
  INFO(ended.out);
  CHECK_THAT(ended.out, Catch::Contains("OFF THE PATH: the model is up to ") &&
                            Catch::Contains("on the way from waypoint ") &&
                            Catch::Contains("right (greatest top_speed 10 mm/s)") &&
                            Catch::Contains("'right' moves at its top_speed, 10 mm/s, for ") &&
                            Catch::Contains("motion.speed 300 mm/s is more than the actuators can do"));
  CHECK(lines_of(ended.out).back() == "not all is well");
}

TEST_CASE("Of a long path the check simulates the beginning, and says so", "[scenario]") {
  const RobotFile slow(finger({{"speed: 10 mm/s", "speed: 1 mm/s"}}));
  const nlohmann::json path = check(slow.path().string(), 0).at("path");
  CHECK(path.at("round_s").get<double>() == Approx(20));
  CHECK(path.at("approach_s").get<double>() + path.at("covered_s").get<double>() == Approx(10).margin(0.01));
}

TEST_CASE("The check tells size, density and cavities, and advises where they look wrong", "[scenario]") {
  const RobotFile plain(finger({{"rate: 600 Hz", "rate: 500 Hz"}}));
  const nlohmann::json good = check(plain.path().string(), 0);
  CHECK(good.at("size_mm").at(2) == Approx(100));
  CHECK(good.at("volume_ml") == Approx(27.9).epsilon(0.01));  // as the robot file says
  CHECK(good.at("density_kg_per_m3") == Approx(0.031 / good.at("volume_ml").get<double>() * 1e6));
  CHECK(good.at("cavities").empty());
  CHECK(good.at("advice").empty());

  const RobotFile odd(
      finger({{"poisson_ratio: 0.45", "poisson_ratio: 0.49"}, {"mass: 0.031 kg", "mass: 2 g"}}));
  const Ended ended = run({kDaemon, odd.path().string(), "--check"});
  CHECK(ended.code == 0);  // advice is no failure
  CHECK_THAT(ended.out, Catch::Contains("material.poisson_ratio 0.49 locks with dilatation: element, see "
                                        "docs/validation.md; use patches"));
  CHECK_THAT(ended.out, Catch::Contains("is mesh.unit right?"));
  CHECK_THAT(ended.out, Catch::Contains("2 actuators of at most 32, 1 effector coordinate of at most 24"));
  CHECK_THAT(ended.out, !Catch::Contains("-0.0"));

  const RobotFile patched(finger({{"rate: 600 Hz", "rate: 500 Hz"},
                                  {"poisson_ratio: 0.45", "poisson_ratio: 0.49\n  dilatation: patches"}}));
  CHECK(check(patched.path().string(), 0).at("advice").empty());
}

TEST_CASE("The check warns of a rate whose period many CANopen drives cannot be told", "[scenario]") {
  const nlohmann::json told = check(kConfig + "finger.yaml", 0);  // 600 Hz
  REQUIRE(told.at("advice").size() == 1);
  CHECK_THAT(told.at("advice").at(0).get<std::string>(),
             Catch::Contains("control.rate 600 Hz is a period of 1.667 ms"));
}

TEST_CASE("The check tells which axes a person must power on in a known place", "[scenario]") {
  const RobotFile absolute(finger(odrive("0.6"))), counting(finger(odrive("0.6", "power_on")));
  // None of the rate either: the positions of ODrive axes come on a clock of their own.
  CHECK(check(absolute.path().string(), 0).at("advice").empty());
  const nlohmann::json advice = check(counting.path().string(), 0).at("advice");
  REQUIRE(advice.size() == 1);
  CHECK_THAT(advice.at(0).get<std::string>(),
             Catch::StartsWith("drive.reference is power_on of 'right', 'left': these must get power where"));
}

TEST_CASE("The check tells which axes follow efforts, and in what steps", "[scenario]") {
  const RobotFile mixed(finger({{"node: 2, ", "node: 2, setpoint: effort, rated_torque: 20 mNm, "}}));
  CHECK(check(mixed.path().string(), 0).at("follow_efforts") == std::vector<std::string>{"left"});
  const Ended ended = run({kDaemon, mixed.path().string(), "--check"});
  CHECK_THAT(ended.out, Catch::Contains("commanded instead of displacements: left in steps of 0.004 N\n"));
  CHECK(check(kConfig + "finger.yaml", 0).at("follow_efforts").empty());
}

TEST_CASE("The check tells what a cavity holds at rest, and what keeps its effector from a waypoint",
          "[scenario]") {
  const auto block = [](const std::string& weight) {
    return Block({{"weight: 100", "weight: " + weight},
                  {"-20 60 kPa", "-20 600 kPa"},
                  {"[2 1 1 mm, 1 -1 0.5 mm]", "[0 0 2 mm]"}});
  };
  const Block loose = block("0"), strict = block("1e6");
  const nlohmann::json cavities = check(loose.file.path().string(), 0).at("cavities");
  REQUIRE(cavities.size() == 2);
  CHECK(cavities.at(0).at("name") == "air");
  CHECK(cavities.at(0).at("volume_at_rest_ml") == Approx(4));
  CHECK(cavities.at(1).at("name") == "volume");
  const Ended ended = run({kDaemon, strict.file.path().string(), "--check"});
  INFO(ended.out);
  CHECK(ended.code == 1);
  CHECK_THAT(ended.out, Catch::Contains("; other effectors may outweigh this one as well"));
}

}  // namespace tendril::app::check_test
