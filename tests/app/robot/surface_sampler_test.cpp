// SPDX-License-Identifier: Apache-2.0
#include "app/robot/surface_sampler.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "app/config/load_config.h"
#include "app/robot/robot.h"
#include "app/robot/robot_geometry.h"
#include "tests/app/robot/block.h"

namespace tendril::app::surface_sampler_test {

using nlohmann::json;

/// What the geometry says of the points that a sampler tells, mm: the surface's nodes, then the points.
std::vector<json> places_in(const json& geometry) {
  std::vector<json> places = geometry.at("surface").at("nodes_mm");
  for (const char* list : {"actuators", "effectors"})
    for (const json& each : geometry.at(list))
      for (const json& point : each.value("points", json::array())) places.push_back(point.at("at_mm"));
  for (const json& load : geometry.at("loads")) places.push_back(load.at("point").at("at_mm"));
  return places;
}

void check_at_rest(const Config& config) {
  const auto robot = build_model(config);
  const SurfaceSampler sampler(robot->model, config);
  rt::Surface surface;
  sampler.sample(robot->model.rest(), 7, surface);
  CHECK(surface.stamp_ns == 7);
  const auto places = places_in(json::parse(robot_geometry(config, robot->model.mesh())));
  REQUIRE(surface.positions.cols() == static_cast<Eigen::Index>(places.size()));
  REQUIRE(sampler.size() == surface.positions.cols());
  double farthest_mm = 0;
  for (std::size_t k = 0; k < places.size(); ++k)
    for (std::size_t axis = 0; axis < 3; ++axis)
      farthest_mm = std::max(farthest_mm, std::abs(places[k][axis].get<double>() -
                                                   1e3 * surface.positions(static_cast<Eigen::Index>(axis),
                                                                           static_cast<Eigen::Index>(k))));
  CHECK(farthest_mm < 1e-3);
}

TEST_CASE("At rest, surface and points are where the robot's geometry has them, in the same order",
          "[unit]") {
  SECTION("a block with an actuator of each kind") { check_at_rest(Block().config); }
  for (const char* robot : {"diamond", "finger"}) SECTION(robot) {
      check_at_rest(load_config(std::string(TENDRIL_SOURCE_DIR) + "/config/" + robot + ".yaml"));
    }
}

TEST_CASE("Free nodes and what is attached to them move with the body, guides and fixed nodes stay",
          "[unit]") {
  const Config config = load_config(std::string(TENDRIL_SOURCE_DIR) + "/config/finger.yaml");
  const auto robot = build_model(config);
  const SurfaceSampler sampler(robot->model, config);
  rt::Surface rest, moved;
  sampler.sample(robot->model.rest(), 0, rest);
  sampler.sample(robot->model.rest().array() + 0.01, 0, moved);
  const json geometry = json::parse(robot_geometry(config, robot->model.mesh()));
  const auto nodes = static_cast<Eigen::Index>(geometry.at("surface").at("nodes_mm").size());
  int still = 0;
  for (Eigen::Index k = 0; k < nodes; ++k) {
    const Eigen::Vector3f way = moved.positions.col(k) - rest.positions.col(k);
    if (way.isZero())
      ++still;
    else
      CHECK((way.array() - 0.01F).abs().maxCoeff() < 1e-6F);
  }
  CHECK(still > 0);
  CHECK(still <= static_cast<int>(geometry.at("fixed_mm").size()));
  Eigen::Index column = nodes;
  for (const json& actuator : geometry.at("actuators"))
    for (const json& point : actuator.value("points", json::array())) {
      const Eigen::Vector3f way = moved.positions.col(column) - rest.positions.col(column);
      if (!point.at("on_body").get<bool>()) CHECK(way.isZero());
      ++column;
    }
}

}  // namespace tendril::app::surface_sampler_test
