// SPDX-License-Identifier: Apache-2.0
#include "app/robot/robot.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <numbers>

#include "app/config/load_config.h"
#include "app/config/master_config.h"
#include "app/robot/bus_check.h"
#include "hal/cia402/cia402_settings.h"
#include "hal/drive/drive_protocol.h"
#include "tests/app/program/programs.h"

// From a configuration to the objects that run: limits and rates in SI, mistakes with file and line.

namespace tendril::app::robot_test {

Config finger_config(const Changes& changes = {}) {
  const RobotFile file(finger(changes));
  return load_config(file.path());
}

/// What building the model says of the finger's file with one piece changed; the line is that of the piece.
void check_refused(const std::string& good, const std::string& bad,
                   const std::vector<std::string>& fragments) {
  INFO("'" << good << "' becomes '" << bad << "'");
  const int line = line_of(good);
  const RobotFile file(finger({{good, bad}}));
  std::string message = "no error";
  try {
    build_model(load_config(file.path()));
  } catch (const ConfigError& error) {
    message = error.what();
  }
  CHECK_THAT(message, Catch::StartsWith(file.path().string() + ":" + std::to_string(line) + ": "));
  for (const std::string& fragment : fragments) CHECK_THAT(message, Catch::Contains(fragment));
}

TEST_CASE("A transmit queue that does not hold a cycle's frames is warned of with what to type", "[unit]") {
  const Config config = finger_config();  // two axes, SYNC, heartbeat
  CHECK(warning_on_queue(config, "can7", 0).empty());
  CHECK(warning_on_queue(config, "can7", 4).empty());
  CHECK_THAT(warning_on_queue(config, "can7", 3),
             Catch::Contains("queue of can7 holds 3 frames, and a cycle has 4") &&
                 Catch::Contains("ip link set can7 txqueuelen 8"));
}

TEST_CASE("What does not fit the mesh is refused with file, line and culprit", "[unit]") {
  check_refused("fixed: base", "fixed: root", {"found 'root'", "a region of finger.msh: base, body"});
  check_refused("fixed: base", "fixed: {box: [1 1 1 m, 2 2 2 m]}",
                {"fixed: found no node of the mesh inside the box"});
  check_refused("fixed: base", "fixed: {box: [-11 -8 -1 mm, -9 -7 1 mm]}", {"fixed: ", "three"});
  check_refused("guide 5 0 0 mm", "body 5 0 2 mm",
                {"actuators[0].cable (right): ", "(5, 0, 2) mm lies 2 mm outside the mesh",
                 "the nearest point of the body is (5, ", "'snap'"});
  check_refused("point: 0 0 -100 mm", "point: 0 0 -103 mm",
                {"effectors[0].point (tip): ", "lies 3 mm outside the mesh"});
}

TEST_CASE("What no effort could move is refused with its line and its name", "[unit]") {
  check_refused("point: 0 0 -100 mm", "point: 0 0 0 mm",
                {"effectors[0].point (tip): it is attached to fixed nodes only"});
  check_refused("cable: [body 5 0 -90 mm, body 5 0 -60 mm, body 5 0 -30 mm, guide 5 0 0 mm]",
                "cable: [body 5 0 0 mm, guide 5 0 20 mm]",
                {"actuators[0].cable (right): it is attached to fixed nodes only"});
}

TEST_CASE("A point outside the mesh by no more than snap is attached", "[unit]") {
  const Config config = finger_config(
      {{"point: 0 0 -100 mm", "point: 0 0 -103 mm"}, {"fixed: base", "fixed: base\nsnap: 4 mm"}});
  const auto robot = build_model(config);
  CHECK(robot->tip(robot->model.rest()).isApprox(Eigen::Vector3d(0, 0, -0.103), 1e-9));
}

TEST_CASE("The mesh's unit, rotation and translation place the body before anything is attached", "[unit]") {
  Config config = finger_config();
  config.mesh.rotation = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()).toRotationMatrix();
  config.mesh.translation = {0, 0, 0.02};
  config.effectors[0].points[0].at = {0, 0, 0.12};
  for (ActuatorConfig& actuator : config.actuators)
    for (PointConfig& point : std::get<CableConfig>(actuator.kind).points) point.at.z() = 0.02 - point.at.z();
  const auto robot = build_model(config);
  CHECK(robot->tip(robot->model.rest()).isApprox(Eigen::Vector3d(0, 0, 0.12), 1e-9));
}

TEST_CASE("The model has the body's material and mass, the plant its own", "[unit]") {
  const Config config = finger_config();
  const auto model = build_model(config), plant = build_plant(config);
  const auto weight = [](const Robot& robot) { return robot.model.masses().sum(); };
  CHECK(weight(*plant) / weight(*model) == Approx(0.0315 / 0.031));
  // Energy at the same strain is in the ratio of the moduli.
  const Eigen::VectorXd stretched = 1.01 * model->model.rest();
  CHECK(plant->model.energy(stretched) / model->model.energy(stretched) == Approx(165.0 / 150));
  CHECK(model->constraints.actuators() == 2);
  CHECK(model->constraints.effector_coordinates() == 1);
}

TEST_CASE("A plant without its section is refused with what the section is for", "[unit]") {
  Config config = finger_config();
  config.plant.reset();
  CHECK_THROWS_WITH(build_plant(config), Catch::Contains(config.file.string()) && Catch::Contains("plant") &&
                                             Catch::Contains("simulated robot"));
}

TEST_CASE("What an axis follows is told to controller and drives alike", "[unit]") {
  const Config config = finger_config({{"node: 2, ", "node: 2, setpoint: effort, rated_torque: 20 mNm, "}});
  const hal::MasterConfig master = master_config(config);
  CHECK(master.axes[0].set_point == hal::SetPoint::kDisplacement);
  CHECK(master.axes[1].set_point == hal::SetPoint::kEffort);
  CHECK(tendril::hal::cia402_settings(master.axes[1]).rated_torque == 0.02);
  CHECK_FALSE(controller_config(config).follows_effort[0]);
  CHECK(controller_config(config).follows_effort[1]);
}

TEST_CASE("The controller's limits are those of the file in SI units", "[unit]") {
  const rt::ControllerConfig c =
      controller_config(finger_config({{"stroke: -3 6 mm", "stroke: -4 7 mm"},
                                       {"coordinates: x ", "coordinates: xz "},
                                       {"stop: hold", "stop: relax"},
                                       {"priority: 80", "priority: 80\n  iteration_cap: 55"},
                                       {"target_age_limit: 500 ms", "target_age_limit: 0.2 s"}}));
  CHECK(c.actuators == 2);
  CHECK(c.effector_coordinates == 2);
  CHECK(c.a_min == Eigen::Vector2d(0.1, 0.1));
  CHECK(c.a_max == Eigen::Vector2d(2, 2));
  CHECK(c.l_min.isApprox(Eigen::Vector2d(-0.004, -0.003)));
  CHECK(c.l_max.isApprox(Eigen::Vector2d(0.007, 0.006)));
  CHECK(c.v_max.isApprox(Eigen::Vector2d(0.03, 0.03)));
  CHECK(c.workspace_min.isApprox(Eigen::Vector2d(-0.015, -0.11)));
  CHECK(c.workspace_max.isApprox(Eigen::Vector2d(0.015, -0.09)));
  CHECK(c.iteration_cap == 55);
  CHECK(c.period_s == Approx(1.0 / 600));
  CHECK(c.snapshot_age_limit_ns == 500'000'000);
  CHECK(c.target_age_limit_ns == 200'000'000);
  CHECK(c.late_cycles_limit == 20);
  CHECK(c.stop == rt::StopAction::kRelax);
}

TEST_CASE("The bus's axes and rates are those of the file in SI units", "[unit]") {
  const Config config =
      finger_config({{"node: 2, counts_per_turn: 65536, pulley_radius: 5 mm",
                      "node: 9, counts_per_turn: 4096, pulley_radius: 8 mm, reversed: true"},
                     {"heartbeat: 50 ms",
                      "heartbeat: 40 ms\n  sdo_timeout: 0.3 s\n  boot_timeout: 5 s\n  enable_timeout: 20 s\n"
                      "  disable_timeout: 3 s"},
                     {"rate: 100 Hz", "rate: 80 Hz"}});
  const hal::MasterConfig m = master_config(config);
  REQUIRE(m.axes.size() == 2);
  CHECK(m.axes[0].name == "right");
  CHECK(m.axes[0].node == 1);
  CHECK(m.axes[0].scale.displacement_per_count() == Approx(2 * std::numbers::pi * 0.005 / 65536));
  CHECK(m.axes[1].node == 9);
  CHECK(m.axes[1].scale.displacement_per_count() == Approx(-2 * std::numbers::pi * 0.008 / 4096));
  CHECK(m.period_ns == 1'666'667);
  CHECK(tendril::hal::cia402_settings(m).master_node == 127);
  CHECK(tendril::hal::cia402_settings(m).sdo_timeout_ns == 300'000'000);
  CHECK(m.start_timeout_ns == 5'000'000'000);
  CHECK(m.start_timeout_ns == 5'000'000'000);
  CHECK(m.enable_timeout_ns == 20'000'000'000);
  CHECK(controller_config(config).disable_limit_ns == 3'000'000'000);
  CHECK(m.heartbeat_ns == 40'000'000);
  CHECK(m.heartbeat_timeout_ns == 150'000'000);
  CHECK(m.feedback_timeout_ns == 50'000'000);
  REQUIRE(m.sensors.size() == 2);
  CHECK(m.sensors[0].id == 0x1F0);
  CHECK(m.sensors[0].rate_hz == 80);
  CHECK_NOTHROW(m.protocol->check(m));
}

TEST_CASE("Effector rows are the controlled coordinates in the order of the effectors", "[unit]") {
  Config config;
  config.effectors = {{"a", {}, {false, true, true}, {}, {1, 2}},
                      {"air", {}, {}, RegionConfig{}, {1000}},
                      {"b", {}, {true, false, false}, {}, {0.5}}};
  const auto rows = effector_rows(config);
  REQUIRE(rows.size() == 4);
  const int effectors[] = {0, 0, 1, 2}, axes[] = {1, 2, EffectorRow::kVolume, 0};
  const double weights[] = {1, 2, 1000, 0.5};
  for (size_t r = 0; r < rows.size(); ++r) {
    CAPTURE(r);
    CHECK(rows[r].effector == effectors[r]);
    CHECK(rows[r].axis == axes[r]);
    CHECK(rows[r].weight == weights[r]);
    CHECK(rows[r].is_position() == (r != 2));
  }
}

}  // namespace tendril::app::robot_test
