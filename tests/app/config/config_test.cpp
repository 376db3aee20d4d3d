// SPDX-License-Identifier: Apache-2.0
#include "app/config/config.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <numbers>
#include <sstream>

#include "app/config/load_config.h"
#include "app/config/quantity.h"
#include "hal/cia402/cia402_protocol.h"
#include "hal/cia402/cia402_settings.h"
#include "tests/app/robot_file.h"

namespace tendril::app::config_test {
using Eigen::Vector3d;

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

TEST_CASE("The manual has the units of every quantity, and the magnitudes that it may have", "[unit]") {
  const std::string text = manual();
  for (int d = static_cast<int>(Dimension::kLength); d <= static_cast<int>(Dimension::kTorque); ++d) {
    const auto dimension = static_cast<Dimension>(d);
    const auto [least, greatest] = magnitudes_of(dimension);
    const std::string row = fmt::format(" | {} | {:g} {} | {:g} {} |\n", units_of(dimension), least,
                                        si_unit(dimension), greatest, si_unit(dimension));
    INFO(row);
    CHECK(text.find(row) != std::string::npos);
  }
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

TEST_CASE("The shipped diamond loads with its exact values in SI", "[unit]") {
  const RobotFile file(read_text_file(kSourceDir / "config/diamond.yaml"), "diamond.msh");
  const Config c = load_config(file.path());

  CHECK(c.file == file.path());
  CHECK(c.robot == "diamond");
  CHECK(c.mesh.file == file.folder() / "diamond.msh");
  CHECK(c.mesh.unit == 0.001);
  CHECK(c.mesh.rotation == Eigen::Matrix3d::Identity());
  CHECK(c.mesh.translation == Vector3d::Zero());
  CHECK(c.material.material.young_modulus == 150000);
  CHECK(c.material.material.poisson_ratio == 0.45);
  CHECK(c.material.mass == 0.5);
  CHECK_FALSE(c.material.mass_per_node);
  CHECK(c.gravity == Vector3d(0, 0, -9.81));
  CHECK(std::get<std::string>(c.fixed.where) == "base");
  CHECK(c.snap == 0);

  REQUIRE(c.effectors.size() == 1);
  CHECK(c.effectors[0].name == "tip");
  REQUIRE(c.effectors[0].points.size() == 1);
  CHECK(c.effectors[0].points[0].at == Vector3d(0, 0, 0.125));
  CHECK(c.effectors[0].points[0].on_body);
  CHECK(c.effectors[0].weights == std::vector<double>{1, 1, 1});
  CHECK(c.effectors[0].controlled == std::array{true, true, true});

  REQUIRE(c.actuators.size() == 4);
  const char* const names[] = {"north", "west", "south", "east"};
  const Vector3d knees[] = {{0, 0.097, 0.045}, {-0.097, 0, 0.045}, {0, -0.097, 0.045}, {0.097, 0, 0.045}};
  const Vector3d guides[] = {{0, 0.01, 0.03}, {-0.01, 0, 0.03}, {0, -0.01, 0.03}, {0.01, 0, 0.03}};
  for (std::size_t i = 0; i < 4; ++i) {
    const ActuatorConfig& actuator = c.actuators[i];
    INFO(actuator.name);
    CHECK(actuator.name == names[i]);
    const auto& points = std::get<CableConfig>(actuator.kind).points;
    REQUIRE(points.size() == 2);
    CHECK(points[0].on_body);
    CHECK(points[0].at == knees[i]);
    CHECK_FALSE(points[1].on_body);
    CHECK(points[1].at == guides[i]);
    CHECK(actuator.effort_min == 0);
    CHECK(actuator.effort_max == 8);
    CHECK(actuator.displacement_min == -0.025);
    CHECK(actuator.displacement_max == 0.035);
    CHECK(actuator.top_rate == 0.1);
    CHECK(actuator.drive.node == int(i) + 1);
    CHECK(actuator.drive.scale.counts_per_turn == 65536);
    CHECK(actuator.drive.scale.displacement_per_turn == Approx(2 * std::numbers::pi * 0.01));
    CHECK_FALSE(actuator.drive.scale.reversed);
  }

  CHECK(c.control.rate_hz == 600);
  CHECK(c.control.epsilon == 0);
  CHECK_FALSE(c.control.iteration_cap);
  CHECK(c.control.priority == 80);
  CHECK(c.control.cpu == -1);
  CHECK(c.control.snapshot_age_limit == 0.5);
  CHECK(c.control.target_age_limit == 0.5);
  CHECK(c.control.late_cycles_limit == 20);
  CHECK(c.control.model_rate_limit_hz == 0);
  CHECK(c.control.model_solver == tendril::fem::LinearSolverKind::kDirect);
  CHECK(c.control.model_tangent == tendril::fem::Tangent::kExact);
  CHECK(c.control.stop == tendril::rt::StopAction::kHold);
  CHECK(c.control.workspace_min == Vector3d(-0.04, -0.04, 0.09));
  CHECK(c.control.workspace_max == Vector3d(0.04, 0.04, 0.15));

  CHECK(c.bus.name == "vcan0");
  CHECK(c.bus.bitrate == 1e6);
  CHECK(c.bus.master.protocol == &tendril::hal::cia402_protocol());
  CHECK(tendril::hal::cia402_settings(c.bus.master).master_node == 127);
  CHECK(c.bus.master.heartbeat_ns == 50'000'000);
  CHECK(c.bus.master.heartbeat_timeout_ns == 150'000'000);

  REQUIRE(c.sensors.size() == 1);
  const tendril::hal::SensorConfig& camera = c.sensors[0].frame;
  CHECK(camera.name == "camera");
  CHECK(camera.id == 0x1F0);
  CHECK(camera.length == 8);
  CHECK(camera.rate_hz == 100);
  CHECK(camera.timeout_ns == 100'000'000);
  CHECK_FALSE(camera.required);
  REQUIRE(camera.signals.size() == 3);
  const char* const coordinates[] = {"tip_x", "tip_y", "tip_z"};
  for (int k = 0; k < 3; ++k) {
    CHECK(camera.signals[k].name == coordinates[k]);
    CHECK(camera.signals[k].start == 16 * k);
    CHECK(camera.signals[k].length == 16);
    CHECK(camera.signals[k].order == tendril::hal::ByteOrder::kIntel);
    CHECK(camera.signals[k].type == tendril::hal::SignalType::kSigned);
    CHECK(camera.signals[k].scale == 1e-5);
    CHECK(camera.signals[k].offset == 0);
    CHECK(camera.signals[k].unit == "m");
    CHECK(c.sensors[0].measures[k] == MeasuredConfig{.effector = 0, .axis = k});
  }
  REQUIRE(camera.age);
  CHECK(camera.age->start == 48);
  CHECK(camera.age->length == 16);
  CHECK(camera.age->scale == 1e-5);
  CHECK(camera.age->unit == "s");

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
  CHECK(c.plant->time_step == 0.005);
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
  const auto& sphere = std::get<tendril::fem::Sphere>(std::get<tendril::fem::Space>(c.fixed.where));
  CHECK(sphere.centre == Vector3d(-0.015, 0, 0.01));
  CHECK(sphere.radius == 0.04);
  CHECK(c.material.material.law == tendril::fem::Law::of<tendril::fem::NeoHookeanElement>());
  CHECK(c.material.material.dilatation == tendril::fem::Dilatation::kPatch);
  REQUIRE(c.material.regions.size() == 1);
  CHECK(std::get<std::string>(c.material.regions[0].where.where) == "sole");
  CHECK(c.material.regions[0].material.young_modulus == 1e6);
  CHECK(c.material.regions[0].material.law == tendril::fem::Law::of<tendril::fem::CorotationalElement>());
  CHECK(c.material.regions[0].material.dilatation == tendril::fem::Dilatation::kElement);
  CHECK(*c.material.regions[0].mass == 0.02);
  REQUIRE(c.loads.size() == 1);
  CHECK(c.loads[0].at.at == Vector3d(0, 0, 0.1));
  CHECK(c.loads[0].force == Vector3d(0, 0, -0.5));
  CHECK(c.snap == 0.003);
  CHECK(c.effectors[0].controlled == std::array{true, false, true});
  CHECK(c.effectors[0].weights == std::vector<double>{1, 0.5});
  REQUIRE(c.effectors[1].points.size() == 2);
  CHECK(c.effectors[1].weights == std::vector<double>{2, 2, 2});
  CHECK(std::get<std::string>(c.effectors[2].cavity->where) == "chamber");
  CHECK(c.effectors[2].weights == std::vector<double>{500});

  REQUIRE(c.actuators.size() == 4);
  const auto& cable = std::get<CableConfig>(c.actuators[0].kind);
  REQUIRE(cable.points.size() == 3);
  CHECK(cable.points[1].on_body);
  CHECK(cable.points[1].at == Vector3d(-0.05, 0, 0.04));
  CHECK(c.actuators[0].drive.scale.reversed);
  const auto& rod = std::get<RodConfig>(c.actuators[1].kind);
  CHECK_FALSE(rod.from.on_body);
  CHECK(rod.to.on_body);
  CHECK(rod.to.at == Vector3d(0.02, 0, 0.02));
  CHECK(c.actuators[1].effort_min == -20);
  CHECK(c.actuators[1].drive.scale.displacement_per_turn == 0.002);
  CHECK(c.actuators[1].drive.scale.offset == Approx(-0.003));
  CHECK(tendril::hal::cia402_settings(c.actuators[1].drive).pdo == 3);
  CHECK(tendril::hal::cia402_settings(c.actuators[1].drive).rpdo_id == 0x442);
  CHECK(tendril::hal::cia402_settings(c.actuators[1].drive).tpdo_id == 0x3C2);
  CHECK(tendril::hal::cia402_settings(c.actuators[1].drive).mapping == tendril::hal::Mapping::kAsFound);
  const auto& push = std::get<ForceConfig>(c.actuators[2].kind);
  CHECK(push.at.at == Vector3d(0, 0.03, 0.05));
  CHECK(push.direction.isApprox(Vector3d(0, 0.6, 0.8)));
  const tendril::hal::Cia402AxisSettings& thumb = tendril::hal::cia402_settings(c.actuators[2].drive);
  CHECK(thumb.reference == tendril::hal::Reference::kHoming);
  CHECK(thumb.referenced_bit == 15);
  CHECK_FALSE(thumb.soft_limits);
  CHECK(c.actuators[2].drive.following_error == 2e-3);
  CHECK(thumb.homing.method == 17);
  CHECK(thumb.homing.speed_search == 200);
  CHECK(thumb.homing.speed_zero == 20);
  CHECK(thumb.homing.acceleration == 1000);
  CHECK(thumb.homing.timeout_ns == 30'000'000'000);
  const ActuatorConfig& air = c.actuators[3];
  CHECK(std::get<std::string>(std::get<CavityConfig>(air.kind).region.where) == "chamber");
  CHECK(air.effort_min == -10e3);
  CHECK(air.effort_max == 40e3);
  CHECK(air.displacement_min == -2e-6);
  CHECK(air.displacement_max == 15e-6);
  CHECK(air.top_rate == 5e-6);
  CHECK(air.drive.scale.displacement_per_turn == Approx(0.8e-6));
  CHECK(air.follows_effort());
  CHECK(tendril::hal::cia402_settings(air.drive).rated_torque == Approx(0.02));
  CHECK(c.control.rate_hz == 1000);
  CHECK(c.control.epsilon == 1e-4);
  CHECK(c.control.iteration_cap == 50);
  CHECK(c.control.priority == 70);
  CHECK(c.control.cpu == 3);
  CHECK(c.control.model_cpu == 2);
  CHECK(c.control.housekeeping_cpu == 1);
  CHECK(c.control.idle_latency == Approx(20e-6));
  CHECK(c.control.snapshot_age_limit == 0.4);
  CHECK(c.control.target_age_limit == 0.3);
  CHECK(c.control.late_cycles_limit == 10);
  CHECK(c.control.model_rate_limit_hz == 15);
  CHECK(c.control.model_solver == tendril::fem::LinearSolverKind::kReused);
  CHECK(c.control.model_tangent == tendril::fem::Tangent::kSemidefinite);
  CHECK(c.control.stop == tendril::rt::StopAction::kRelax);
  CHECK(c.bus.name == "local:/run/tendril/bus");
  CHECK(c.bus.bitrate == 5e5);
  CHECK(tendril::hal::cia402_settings(c.bus.master).master_node == 126);
  CHECK(c.bus.master.heartbeat_ns == 100'000'000);
  CHECK(c.bus.master.heartbeat_timeout_ns == 250'000'000);
  REQUIRE(c.sensors.size() == 2);
  CHECK(c.sensors[0].frame.required);
  CHECK(c.sensors[0].frame.length == 8);
  CHECK(c.sensors[0].frame.timeout_ns == 150'000'000);
  CHECK(c.sensors[0].measures[0] == MeasuredConfig{.effector = 1, .axis = 1});
  CHECK(c.sensors[0].frame.age->offset == 0.001);
  CHECK(c.sensors[0].frame.age->order == tendril::hal::ByteOrder::kMotorola);
  using tendril::hal::ByteOrder;
  const auto& cells = c.sensors[1].frame;
  CHECK(cells.length == 7);  // as far as the signals reach
  CHECK_FALSE(cells.age);
  CHECK(cells.timeout_ns == 100'000'000);
  CHECK(cells.signals[0].name == "left_tension");
  CHECK(cells.signals[0].order == ByteOrder::kMotorola);
  CHECK(cells.signals[0].type == tendril::hal::SignalType::kFloat);
  CHECK(cells.signals[0].offset == Approx(-0.1));
  CHECK(cells.signals[1].name == "strut_force");
  CHECK(cells.signals[2].name == "air_pressure");
  CHECK(cells.signals[2].scale == 250);
  CHECK(cells.signals[2].unit == "Pa");
  for (int a = 0; a < 3; ++a) CHECK(c.sensors[1].measures[a].effector == -1);
  CHECK(c.sensors[1].measures[0].actuator == 0);
  CHECK(c.sensors[1].measures[1].actuator == 1);
  CHECK(c.sensors[1].measures[2].actuator == 3);
  CHECK_FALSE(c.motion->closed);
  CHECK(c.motion->effector == 1);
  CHECK(c.motion->acceleration == 0.2);
  CHECK(c.motion->jerk == 4.0);
  CHECK(c.motion->corners == 0.001);
  CHECK_FALSE(c.motion->turns);
  CHECK_FALSE(c.motion->curve);
  REQUIRE(c.plant->loads.size() == 1);
  CHECK(c.plant->loads[0].force == Vector3d(0.2, 0, 0));
  CHECK(c.plant->damping_stiffness == 0.02);
  CHECK(c.plant->time_step == 0.005);
  CHECK(c.plant->drives.force_limit == 1.5);
  CHECK(c.plant->drives.friction == 0.1);
  CHECK(c.plant->drives.acceleration_time == Approx(8e-3));
  CHECK(c.plant->drives.position_gain == 60);
  CHECK(tendril::hal::settings_as<tendril::hal::Cia402SimulationSettings>(c.plant->drives.protocol_settings)
            .following_error == 0.1);
  REQUIRE(c.plant->faults.size() == 1);
  CHECK(c.plant->faults[0].kind == PlantFaultKind::kSilent);
  CHECK(c.plant->faults[0].axis == 0);
  CHECK(c.plant->faults[0].after == 5);
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
    drive: {node: 127, counts_per_turn: 40960.5, pulley_radius: 1 cm}
bus: {name: can0, master_node: 1}
)");
  const Config c = load_config(file.path());
  CHECK(c.mesh.unit == 1e-3);
  CHECK(c.gravity == Vector3d(0, 0, -9.81));
  CHECK(c.effectors[0].controlled == std::array{true, true, true});
  CHECK(c.control.rate_hz == 600);
  CHECK(c.control.workspace_max == Vector3d::Ones());
  CHECK(c.bus.master.heartbeat_timeout_ns == 150'000'000);
  CHECK(c.sensors.empty());
  CHECK_FALSE(c.motion);
  CHECK_FALSE(c.plant);
  CHECK(c.mesh.line == 3);
  CHECK(c.effectors[0].points[0].line == 6);
  CHECK(std::get<CableConfig>(c.actuators[0].kind).points[1].line == 9);
  CHECK(tendril::hal::cia402_settings(c.actuators[0].drive).reference == tendril::hal::Reference::kAbsolute);
  CHECK(tendril::hal::cia402_settings(c.actuators[0].drive).referenced_bit == -1);
  CHECK(tendril::hal::cia402_settings(c.actuators[0].drive).soft_limits);
  CHECK(tendril::hal::cia402_settings(c.actuators[0].drive).mapping == tendril::hal::Mapping::kConfigure);
  CHECK(c.actuators[0].drive.following_error == 0);
  CHECK_FALSE(c.actuators[0].follows_effort());
  CHECK(c.fixed.line == 5);
  CHECK(c.bus.line == 14);
}

}  // namespace tendril::app::config_test
