#include <catch2/catch.hpp>

#include "tests/app/programs.h"

// `tendrild --check`: what it finds, for people and for machines, without a bus.

namespace tendril::app {
namespace {

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
  CHECK(lines_of(ended.out).back() == "all is well");
}

TEST_CASE("The diamond that is shipped passes its check", "[scenario]") {
  check_shipped("diamond", 1603, 4, 4);
}

TEST_CASE("A waypoint out of reach fails the check, which names it", "[scenario]") {
  const RobotFile far(
      finger({{"waypoints: [5 0 0 mm, -5 0 0 mm]", "waypoints: [5 0 0 mm, 80 0 0 mm]"},
              {"workspace: [-15 -5 -110 mm, 15 5 -90 mm]", "workspace: [-15 -5 -110 mm, 100 5 -90 mm]"}}));
  const nlohmann::json result = check(far.path().string(), 1);
  CHECK(result.at("waypoints").at(0).at("reached") == true);
  CHECK(result.at("waypoints").at(1).at("reached") == false);
  CHECK(result.at("waypoints").at(1).at("miss_mm") > 10);

  const Ended ended = run({kDaemon, far.path().string(), "--check"});
  CHECK(ended.code == 1);
  CHECK_THAT(ended.out, Catch::Contains("waypoint 1   (80.0) mm OUT OF REACH"));
  CHECK(lines_of(ended.out).back() == "not all is well");
}

}  // namespace
}  // namespace tendril::app
