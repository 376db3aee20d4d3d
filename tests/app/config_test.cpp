#include "app/config.h"

#include <catch2/catch.hpp>
#include <sstream>

#include "robot_file.h"

using namespace tendril::app;
using Eigen::Vector3d;

namespace {

const std::filesystem::path kSourceDir = TENDRIL_SOURCE_DIR;

std::string manual() { return read_text_file(kSourceDir / "docs/robot-file.md"); }

/// The example at the end of the manual.
std::string manual_example() {
  const std::string text = manual();
  const std::string fence = "```yaml\n";
  const std::size_t begin = text.find(fence);
  REQUIRE(begin != std::string::npos);
  return text.substr(begin + fence.size(), text.find("```", begin + 1) - begin - fence.size());
}

/// The keys in the manual's tables: a heading "## `section`" goes before the keys of the rows under it.
ConfigKeys manual_keys() {
  ConfigKeys keys;
  std::string prefix, line;
  std::istringstream lines(manual());
  while (std::getline(lines, line)) {
    if (line.starts_with("## ")) {
      prefix = line.starts_with("## `") ? line.substr(4, line.find('`', 4) - 4) + "." : "";
    } else if (line.starts_with("| `")) {
      const bool is_new =
          keys.emplace(prefix + line.substr(3, line.find('`', 3) - 3), line.ends_with("| required |")).second;
      INFO(line);
      CHECK(is_new);
    }
  }
  return keys;
}

}  // namespace

TEST_CASE("The shipped diamond loads with its exact values in SI", "[unit]") {
  const RobotFile file(read_text_file(kSourceDir / "config/diamond.yaml"), "diamond.msh");
  const Config c = load_config(file.path());

  CHECK(c.file == file.path());
  CHECK(c.robot == "diamond");
  CHECK(c.mesh.file == file.folder() / "diamond.msh");
  CHECK(c.mesh.unit == 0.001);
  CHECK(c.mesh.rotation == Eigen::Matrix3d::Identity());
  CHECK(c.mesh.translation == Vector3d::Zero());
  CHECK(c.material.young_modulus == 150000);
  CHECK(c.material.poisson_ratio == 0.45);
  CHECK(c.material.mass == 0.5);
  CHECK_FALSE(c.material.mass_per_node);
  CHECK(c.gravity == Vector3d(0, 0, -9.81));
  CHECK(c.fixed.region == "base");
  CHECK(c.snap == 0);

  REQUIRE(c.effectors.size() == 1);
  CHECK(c.effectors[0].name == "tip");
  CHECK(c.effectors[0].point.at == Vector3d(0, 0, 0.125));
  CHECK(c.effectors[0].point.on_body);
  CHECK(c.effectors[0].controlled == std::array{true, true, true});

  REQUIRE(c.cables.size() == 4);
  const char* const names[] = {"north", "west", "south", "east"};
  const Vector3d knees[] = {{0, 0.097, 0.045}, {-0.097, 0, 0.045}, {0, -0.097, 0.045}, {0.097, 0, 0.045}};
  const Vector3d guides[] = {{0, 0.01, 0.03}, {-0.01, 0, 0.03}, {0, -0.01, 0.03}, {0.01, 0, 0.03}};
  for (std::size_t i = 0; i < 4; ++i) {
    const CableConfig& cable = c.cables[i];
    INFO(cable.name);
    CHECK(cable.name == names[i]);
    REQUIRE(cable.points.size() == 2);
    CHECK(cable.points[0].on_body);
    CHECK(cable.points[0].at == knees[i]);
    CHECK_FALSE(cable.points[1].on_body);
    CHECK(cable.points[1].at == guides[i]);
    CHECK(cable.tension_min == 0);
    CHECK(cable.tension_max == 8);
    CHECK(cable.stroke_min == -0.025);
    CHECK(cable.stroke_max == 0.035);
    CHECK(cable.top_speed == 0.1);
    CHECK(cable.drive.node == int(i) + 1);
    CHECK(cable.drive.counts_per_turn == 65536);
    CHECK(cable.drive.pulley_radius == 0.01);
    CHECK_FALSE(cable.drive.reversed);
  }

  CHECK(c.control.rate_hz == 600);
  CHECK(c.control.epsilon == 0.001);
  CHECK(c.control.iteration_cap == 100);
  CHECK(c.control.priority == 80);
  CHECK(c.control.cpu == -1);
  CHECK(c.control.snapshot_age_limit == 0.5);
  CHECK(c.control.target_age_limit == 0.5);
  CHECK(c.control.late_cycles_limit == 20);
  CHECK(c.control.model_rate_limit_hz == 0);
  CHECK(c.control.stop == tendril::rt::StopAction::kHold);
  CHECK(c.control.workspace_min == Vector3d(-0.04, -0.04, 0.09));
  CHECK(c.control.workspace_max == Vector3d(0.04, 0.04, 0.15));

  CHECK(c.bus.name == "vcan0");
  CHECK(c.bus.bitrate == 1e6);
  CHECK(c.bus.master_node == 127);
  CHECK(c.bus.heartbeat == 0.05);
  CHECK(c.bus.heartbeat_timeout == 0.15);
  CHECK(c.bus.tracker_id == 0x1F0);

  REQUIRE(c.motion);
  CHECK(c.motion->origin == Vector3d(0, 0, 0.125));
  CHECK(c.motion->waypoints ==
        std::vector<Vector3d>{{0.01, 0.01, 0}, {-0.01, 0.01, 0}, {-0.01, -0.01, 0}, {0.01, -0.01, 0}});
  CHECK(c.motion->speed == 0.025);
  CHECK(c.motion->closed);

  REQUIRE(c.plant);
  CHECK(c.plant->young_modulus == 165000);
  CHECK(c.plant->poisson_ratio == 0.45);
  CHECK(c.plant->mass == 0.51);
  CHECK(c.plant->damping_mass == 2);
  CHECK(c.plant->damping_stiffness == 0.01);
  CHECK(c.plant->time_step == 0.02);
  CHECK(c.plant->tracker_rate_hz == 50);
}

TEST_CASE("Every robot that is shipped loads, its mesh called after it", "[unit]") {
  int robots = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kSourceDir / "config")) {
    if (entry.path().extension() != ".yaml") continue;
    INFO(entry.path());
    const std::string name = entry.path().stem().string();
    CHECK(load_config(RobotFile(read_text_file(entry.path()), name + ".msh").path()).robot == name);
    ++robots;
  }
  CHECK(robots >= 1);
}

TEST_CASE("The manual's example sets every key to a value of its own", "[unit]") {
  const RobotFile file(manual_example());
  const Config c = load_config(file.path());

  CHECK((c.mesh.rotation * Vector3d::UnitY() - Vector3d::UnitZ()).norm() < 1e-15);
  CHECK(c.mesh.translation == Vector3d(0, 0, 0.035));
  CHECK(c.material.mass == 0.5);
  CHECK(c.material.mass_per_node);
  CHECK(c.fixed.region.empty());
  CHECK(c.fixed.box_min == Vector3d(-0.015, -0.015, -0.04));
  CHECK(c.fixed.box_max == Vector3d(0.015, 0.015, 0.01));
  CHECK(c.snap == 0.003);
  CHECK(c.effectors[0].controlled == std::array{true, false, true});
  REQUIRE(c.cables[0].points.size() == 3);
  CHECK(c.cables[0].points[1].on_body);
  CHECK(c.cables[0].points[1].at == Vector3d(-0.05, 0, 0.04));
  CHECK(c.cables[0].drive.reversed);
  CHECK(c.control.rate_hz == 1000);
  CHECK(c.control.epsilon == 1e-4);
  CHECK(c.control.iteration_cap == 50);
  CHECK(c.control.priority == 70);
  CHECK(c.control.cpu == 3);
  CHECK(c.control.snapshot_age_limit == 0.4);
  CHECK(c.control.target_age_limit == 0.3);
  CHECK(c.control.late_cycles_limit == 10);
  CHECK(c.control.model_rate_limit_hz == 15);
  CHECK(c.control.stop == tendril::rt::StopAction::kRelax);
  CHECK(c.bus.name == "local:/run/tendril/bus");
  CHECK(c.bus.bitrate == 5e5);
  CHECK(c.bus.master_node == 126);
  CHECK(c.bus.heartbeat == 0.1);
  CHECK(c.bus.heartbeat_timeout == 0.25);
  CHECK_FALSE(c.motion->closed);
  CHECK(c.plant->damping_stiffness == 0.02);
  CHECK(c.plant->time_step == 0.005);
  CHECK(c.plant->tracker_rate_hz == 50);
}

TEST_CASE("The manual lists the keys that the reader knows, and says which are required", "[unit]") {
  const RobotFile file(manual_example());
  ConfigKeys known;
  load_config(file.path(), &known);
  const ConfigKeys listed = manual_keys();
  for (const auto& [key, required] : known) {
    INFO(key << (required ? " is required" : " is optional"));
    REQUIRE(listed.contains(key));
    CHECK(listed.at(key) == required);
  }
  for (const auto& [key, required] : listed) {
    INFO(key);
    CHECK(known.contains(key));
  }
}

TEST_CASE("A file with the required keys alone gets the documented defaults", "[unit]") {
  const RobotFile file(R"(
robot: bare
mesh: {file: body.msh}
material: {young_modulus: 1 MPa, poisson_ratio: 0, mass: 1 kg}
fixed: base
effectors: [{name: tip, point: 0 0 1 m}]
actuators:
  - name: pull
    cable: [body 0 0 1 m, guide 0 0 2 m]
    tension: 1 1 N
    stroke: 1 2 mm
    top_speed: 1 m/s
    drive: {node: 127, counts_per_turn: 4096.5, pulley_radius: 1 cm}
bus: {name: can0, master_node: 1}
)");
  const Config c = load_config(file.path());
  CHECK(c.mesh.unit == 1e-3);
  CHECK(c.gravity == Vector3d(0, 0, -9.81));
  CHECK(c.effectors[0].controlled == std::array{true, true, true});
  CHECK(c.control.rate_hz == 600);
  CHECK(c.control.workspace_max == Vector3d::Ones());
  CHECK(c.bus.heartbeat_timeout == 0.15);
  CHECK(c.bus.tracker_id == 0);
  CHECK_FALSE(c.motion);
  CHECK_FALSE(c.plant);
  CHECK(c.effectors[0].point.line == 6);
  CHECK(c.cables[0].points[1].line == 9);
  CHECK(c.cables[0].drive.line == 13);
  CHECK(c.fixed.line == 5);
  CHECK(c.bus.line == 14);
}
