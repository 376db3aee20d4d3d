// SPDX-License-Identifier: Apache-2.0
#include "app/robot/robot_geometry.h"

#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "app/config/load_config.h"
#include "app/robot/body.h"
#include "app/robot/robot.h"
#include "tests/app/program/programs.h"
#include "tests/app/robot/block.h"

// What the picture of a robot is drawn from.

namespace tendril::app::robot_geometry_test {

using nlohmann::json;

json geometry_of(const Config& config) { return json::parse(robot_geometry(config, load_mesh(config))); }

json shipped(const std::string& robot) {
  const json geometry =
      geometry_of(load_config(std::string(TENDRIL_SOURCE_DIR) + "/config/" + robot + ".yaml"));
  CHECK(geometry.at("robot") == robot);
  CHECK(geometry.at("problems").empty());
  CHECK(geometry.at("gravity_m_per_s2") == json({0, 0, -9.81}));
  return geometry;
}

std::vector<std::string> names(const json& list) {
  std::vector<std::string> result;
  for (const json& each : list) result.push_back(each.at("name"));
  return result;
}

json body(double x, double y, double z) { return {{"at_mm", {x, y, z}}, {"on_body", true}}; }
json guide(double x, double y, double z) { return {{"at_mm", {x, y, z}}, {"on_body", false}}; }

/// Points agree to what attaching and printing them leaves.
void check_points(const json& found, const json& expected) {
  INFO(found.dump() << " is not " << expected.dump());
  REQUIRE(found.size() == expected.size());
  for (std::size_t p = 0; p < found.size(); ++p) {
    CHECK(found[p].at("on_body") == expected[p].at("on_body"));
    CHECK_FALSE(found[p].contains("misplaced"));
    for (std::size_t k = 0; k < 3; ++k)
      CHECK(found[p].at("at_mm")[k].get<double>() ==
            Approx(expected[p].at("at_mm")[k].get<double>()).margin(2e-4));
  }
}

/// The volume that faces of the surface enclose, ml; negative where they are seen from inside it.
double volume_ml(const json& geometry, const json& faces) {
  double sum = 0;
  for (const json& face : faces) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis)
        corners(axis, k) =
            geometry.at("surface").at("nodes_mm").at(face.at(k).get<std::size_t>()).at(axis).get<double>();
    sum += corners.determinant() / 6;
  }
  return 1e-3 * sum;
}

TEST_CASE("The diamond's picture has its cables as they are typed, its workspace and its square", "[unit]") {
  const json diamond = shipped("diamond");
  CHECK(diamond.at("nodes") == 1603);
  CHECK(names(diamond.at("actuators")) == std::vector<std::string>{"north", "west", "south", "east"});
  for (const json& cable : diamond.at("actuators")) CHECK(cable.at("kind") == "cable");
  check_points(diamond.at("actuators")[1].at("points"), {body(-97, 0, 45), guide(-10, 0, 30)});
  check_points(diamond.at("effectors").at(0).at("points"), json::array({body(0, 0, 125)}));
  CHECK(diamond.at("effectors")[0].at("coordinates") == "xyz");
  CHECK(diamond.at("workspace_mm") == json({{-40, -40, 90}, {40, 40, 150}}));
  CHECK(diamond.at("motion") ==
        json({{"effector", "tip"},
              {"origin_mm", {0, 0, 125}},
              {"waypoints_mm", {{10, 10, 125}, {-10, 10, 125}, {-10, -10, 125}, {10, -10, 125}}},
              {"closed", true}}));
  for (const json& fixed : diamond.at("fixed_mm")) CHECK(fixed.at(2) < 0);
}

TEST_CASE("The surface of a picture encloses the body, and its size is that of the mesh", "[unit]") {
  const json finger = shipped("finger");
  CHECK(volume_ml(finger, finger.at("surface").at("faces")) == Approx(27.9).epsilon(0.01));
  CHECK(finger.at("size_mm").at(2) == 100);
  CHECK(finger.at("fixed_mm").size() > 3);
  for (const json& fixed : finger.at("fixed_mm")) CHECK(fixed.at(2) == 0);
  check_points(finger.at("actuators").at(0).at("points"),
               {body(5, 0, -90), body(5, 0, -60), body(5, 0, -30), guide(5, 0, 0)});
}

TEST_CASE("The bender's picture has the wall of its chamber", "[unit]") {
  const json bender = shipped("bender");
  const json& pump = bender.at("actuators").at(0);
  CHECK(pump.at("kind") == "cavity");
  CHECK(volume_ml(bender, pump.at("faces")) == Approx(-6.72).epsilon(0.01));
}

TEST_CASE("The platform's picture has its rods, and all points of a mean", "[unit]") {
  const json platform = shipped("platform");
  CHECK(platform.at("actuators").at(0).at("kind") == "rod");
  check_points(platform.at("actuators")[0].at("points"), {guide(0, 24, -60), body(0, 24, 0)});
  const json& height = platform.at("effectors").at(1);
  CHECK(height.at("coordinates") == "z");
  check_points(height.at("points"), {body(20, 0, 10), body(0, 20, 10), body(-20, 0, 10), body(0, -20, 10)});
}

TEST_CASE("The trunk's picture has its eight cables and two effectors", "[unit]") {
  const json trunk = shipped("trunk");
  CHECK(names(trunk.at("actuators")) ==
        std::vector<std::string>{"east", "north", "west", "south", "tip-ne", "tip-nw", "tip-sw", "tip-se"});
  CHECK(names(trunk.at("effectors")) == std::vector<std::string>{"tip", "middle"});
}

TEST_CASE("A picture has pushes, loads and the volumes that are controlled", "[unit]") {
  const json block = geometry_of(Block().config);
  const json& thumb = block.at("actuators").at(kThumb);
  CHECK(thumb.at("kind") == "push");
  CHECK(thumb.at("direction") == json({0, 0, 1}));
  check_points(thumb.at("points"), json::array({body(-15, 0, 50)}));
  CHECK(block.at("loads").at(0).at("force_N") == json({0, 0, -0.1}));
  CHECK(volume_ml(block, block.at("effectors").at(1).at("faces")) == Approx(-4));
}

TEST_CASE("Every point and region that does not fit the mesh is told in the picture, with its line",
          "[unit]") {
  const RobotFile file(finger({{"guide 5 0 0 mm", "body 5 0 2 mm"},
                               {"fixed: base", "fixed: root"},
                               {"point: 0 0 -100 mm", "point: 0 0 -103 mm"}}));
  const json geometry = geometry_of(load_config(file.path()));
  CHECK(geometry.at("fixed_mm").empty());
  const json& problems = geometry.at("problems");
  REQUIRE(problems.size() == 3);
  const auto told = [&](const std::string& at, const std::string& what) {
    return Catch::StartsWith("robot.yaml:" + std::to_string(line_of(at)) + ": " + what);
  };
  CHECK_THAT(problems[0].get<std::string>(), told("fixed: ", "fixed: found 'root'"));
  CHECK_THAT(problems[1].get<std::string>(), told("guide 5 0 0 mm", "actuators[0].cable (right): "));
  CHECK_THAT(problems[2].get<std::string>(), told("point: 0 0 -100", "effectors[0].point (tip): "));
  const json& points = geometry.at("actuators").at(0).at("points");
  CHECK(points.at(3).at("at_mm") == json({5, 0, 2}));
  CHECK(points.at(3).at("misplaced") == true);
  CHECK_FALSE(points.at(2).contains("misplaced"));
}

TEST_CASE("A file without workspace and motion has none in its picture", "[unit]") {
  Config config = load_config(std::string(TENDRIL_SOURCE_DIR) + "/config/finger.yaml");
  config.motion.reset();
  config.control = {};
  const json geometry = geometry_of(config);
  CHECK(geometry.at("workspace_mm").is_null());
  CHECK(geometry.at("motion").is_null());
}

TEST_CASE("The picture of a run is that of the check, though the model numbers its nodes otherwise",
          "[unit]") {
  const Config config = load_config(std::string(TENDRIL_SOURCE_DIR) + "/config/finger.yaml");
  const json checked = geometry_of(config);
  const json run = json::parse(robot_geometry(config, build_model(config)->model.mesh()));
  const auto sorted = [](const json& list) {
    auto result = list.get<std::vector<std::vector<double>>>();
    std::ranges::sort(result);
    return result;
  };
  CHECK(sorted(run.at("fixed_mm")) == sorted(checked.at("fixed_mm")));
  CHECK(sorted(run.at("surface").at("nodes_mm")) == sorted(checked.at("surface").at("nodes_mm")));
  CHECK(volume_ml(run, run.at("surface").at("faces")) ==
        Approx(volume_ml(checked, checked.at("surface").at("faces"))));
}

}  // namespace tendril::app::robot_geometry_test
