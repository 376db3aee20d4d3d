// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "app/robot/inverse_statics.h"
#include "app/robot/model_refresher.h"
#include "app/virtual_time/virtual_rig.h"
#include "tests/app/robot/block.h"

// A robot with one actuator of each kind, from its file to its motion.

namespace tendril::app::actuator_kinds_test {

constexpr double kMean_mm = 0.5, kMax_mm = 1.5;  // of the tip, on a body 10 % stiffer than the model

/// The block drawn out along z by a factor; its foot, at z = 0, stays.
Eigen::VectorXd drawn(const fem::Model& model, double factor) {
  Eigen::VectorXd x = model.rest();
  for (Eigen::Index z = 2; z < x.size(); z += 3) x[z] *= factor;
  return x;
}

TEST_CASE("Displacements of all kinds are what geometry says, in metres and cubic metres", "[law]") {
  const Block block;
  const auto robot = build_model(block.config);
  REQUIRE(robot->constraints.actuators() == 4);
  const Eigen::VectorXd x = drawn(robot->model, 1.1);
  const Eigen::VectorXd delta_a = robot->constraints.displacement(x);
  CHECK(delta_a[kAir] == Approx(0.1 * 4e-6));  // the cavity's floor is at 10 mm: it is drawn out by a tenth
  CHECK(delta_a[kString] == Approx(0.045 - std::hypot(0.045, 0.006)));
  CHECK(delta_a[kStrut] == Approx(std::hypot(0.045, 0.004) - 0.045));
  CHECK(delta_a[kThumb] == Approx(0.005));
  for (int a = 0; a < 4; ++a) CHECK(robot->constraints.pull_only(a) == (a == kString));
  const Eigen::VectorXd p_e = robot->constraints.effector_position(x);
  REQUIRE(p_e.size() == 4);
  CHECK(p_e.head<3>().isApprox(Eigen::Vector3d(0, 0, 0.066)));
  CHECK(p_e[3] == Approx(4.4e-6));
  CHECK(robot->tip(x).isApprox(Eigen::Vector3d(0, 0, 0.066)));
}

TEST_CASE("A region has its modulus and its mass, the plant both in proportion", "[law]") {
  const Block block;
  const auto model = build_model(block.config), plant = build_plant(block.config);
  Block plain;
  plain.config.material.regions.clear();
  const auto even = build_model(plain.config);
  const auto energy = [](const Robot& robot) { return robot.model.energy(drawn(robot.model, 1.01)); };
  // 9 cubes of 1 MPa, 41 of 200 kPa.
  CHECK(energy(*model) / energy(*even) == Approx((9 * 5 + 41) / 50.0));
  CHECK(energy(*plant) / energy(*model) == Approx(1.1));
  // The nodes at the top have what is left of the mass, by volume: two thirds of a cube each on average.
  const auto weight = [](const Robot& robot) { return robot.model.masses().sum() / 3; };
  CHECK(weight(*plant) / weight(*model) == Approx(63.0 / 60));
  CHECK(weight(*model) < 0.060 - 0.002);
  CHECK(weight(*model) > 0.048);
}

TEST_CASE("Loads act on the model and the plant, those of the plant on the plant alone", "[law]") {
  const Changes unknown = {
      {"  time_step: 5 ms", "  loads: [{at: 0 0 60 mm, force: 0.3 0 0 N}]\n  time_step: 5 ms"}};
  const Block block(unknown);
  const auto force = [](const Robot& robot) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const auto& f = robot.model.external_forces();
    for (Eigen::Index i = 0; i < f.size(); i += 3) sum += f.segment<3>(i);
    sum.z() += 9.81 * robot.model.masses().sum() / 3;
    return sum;
  };
  CHECK((force(*build_model(block.config)) - Eigen::Vector3d(0, 0, -0.1)).norm() < 1e-12);
  CHECK((force(*build_plant(block.config)) - Eigen::Vector3d(0.3, 0, -0.1)).norm() < 1e-12);
  CHECK(PlantBody(block.config).tip().x() > PlantBody(Block().config).tip().x() + 3e-4);
}

TEST_CASE("What of a cavity, a load or a region does not fit the mesh is refused with its line", "[unit]") {
  const auto refused = [](const std::string& from, const std::string& to) {
    const Block block({{from, to}});
    try {
      build_model(block.config);
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  const auto at = [](int line) { return Catch::Contains("robot.yaml:" + std::to_string(line) + ": "); };
  CHECK_THAT(refused("cavity: {box: [-5 -5 10 mm, 5 5 50 mm]}\n", "cavity: chamber\n"),
             at(20) && Catch::Contains(
                           "actuators[0].cavity (air): found 'chamber', expected a region of block.msh"));
  CHECK_THAT(
      refused("cavity: {box: [-5 -5 10 mm, 5 5 50 mm]}\n", "cavity: {box: [-5 -5 10 mm, 5 5 40 mm]}\n"),
      at(20) && Catch::Contains("actuators[0].cavity (air): "));
  CHECK_THAT(refused("where: {box: [-15 -15 0 mm, 15 15 10 mm]}", "where: {sphere: 0 0 100 1 mm}"),
             at(8) && Catch::Contains("material.regions[0].where: found no tetrahedron"));
  CHECK_THAT(refused("{at: 0 0 60 mm", "{at: 0 0 70 mm"), at(13) && Catch::Contains("loads"));
}

TEST_CASE("No more may be taken out of a cavity than it holds at rest", "[unit]") {
  const auto growth = [](const std::string& least) {
    return Block({{"growth: -1 ", "growth: " + least + " "}});
  };
  CHECK_NOTHROW(build_model(growth("-3.99").config));
  CHECK_THROWS_WITH(build_model(growth("-4.01").config),
                    Catch::Contains("robot.yaml:22: actuators[0].growth (air): found -4.01 ml, expected more "
                                    "than -4 ml, as the cavity holds 4 ml at rest"));
}

TEST_CASE("The heavier the weight of the volume, the less of it is given up for the tip", "[law]") {
  const auto reached = [](const std::string& weight) {
    const Block block({{"weight: 100", "weight: " + weight},
                       {"-3 3 N", "-0.1 0.1 N"},
                       {"control:", "control:\n  epsilon: 1e-6"}});
    const auto robot = build_model(block.config);
    rt::EffectorVector goal = effectors_at_rest(*robot);
    goal.head<3>() += Eigen::Vector3d(0, 0, 0.0004);
    const StaticSolution result = solve_inverse_statics(*robot, block.config, goal);
    REQUIRE(result.converged);
    return rt::EffectorVector(result.p_e - goal);
  };
  const auto light = reached("0"), middle = reached("2000"), heavy = reached("1e5");
  CAPTURE(light.transpose(), middle.transpose(), heavy.transpose());
  CHECK(std::abs(light[2]) < 1e-4);
  CHECK(std::abs(heavy[3]) < 1e-8);
  CHECK(std::abs(light[2]) < std::abs(middle[2]));
  CHECK(std::abs(middle[2]) < std::abs(heavy[2]));
  CHECK(std::abs(light[3]) > std::abs(middle[3]));
  CHECK(std::abs(middle[3]) > std::abs(heavy[3]));
}

TEST_CASE(
    "What a joule is worth does not depend on the units of efforts and is a ratio of norms for one unit",
    "[law]") {
  const unsigned seed = Catch::rngSeed() + 1;
  CAPTURE(seed);
  std::srand(seed);
  const Eigen::MatrixXd J = Eigen::MatrixXd::Random(3, 4), R = Eigen::MatrixXd::Random(4, 4);
  const qp::Matrix H = J.transpose() * J, W = R * R.transpose();
  const auto norm = [](const qp::Matrix& M) { return M.cwiseAbs().rowwise().sum().maxCoeff(); };
  for (const bool unit : {false, true})
    CHECK(error_per_joule(H, W, Eigen::ArrayX<bool>::Constant(4, unit)) == Approx(norm(H) / norm(W)));
  Eigen::ArrayX<bool> pressure(4);
  pressure << true, false, false, true;
  const double plain = error_per_joule(H, W, pressure);
  for (const double kilo : {1e-6, 1e-3, 1e3}) {
    const Eigen::VectorXd unit = pressure.select(Eigen::ArrayXd::Constant(4, kilo), 1.0);
    const qp::Matrix H_kilo = unit.asDiagonal() * H * unit.asDiagonal();
    const qp::Matrix W_kilo = unit.asDiagonal() * W * unit.asDiagonal();
    CHECK(error_per_joule(H_kilo, W_kilo, pressure) == Approx(plain));
  }
}

TEST_CASE("A snapshot carries the effectors' weights squared", "[unit]") {
  const Block block;
  const auto robot = build_model(block.config);
  ModelRefresher model(*robot, block.config);
  const auto snapshot = std::make_unique<rt::Snapshot>();
  REQUIRE(model.settle(Eigen::VectorXd::Zero(4)));
  REQUIRE(model.refresh({}, 0, *snapshot));
  const Eigen::Vector4d squared(1, 1, 1, 1e4);
  CHECK(snapshot->D_W_ea.isApprox(squared.asDiagonal() * snapshot->W_ea));
  CHECK(snapshot->W_ea.row(3).norm() > 0);
}

TEST_CASE("A robot with an actuator of each kind follows its path over the bus", "[scenario]") {
  const Block block;
  VirtualRig rig(block.config, {});
  rig.run_for(3);
  REQUIRE(rig.phase() == rt::Phase::kRunning);
  REQUIRE(rig.motion());
  for (const rt::TraceRecord& record : rig.trace()) REQUIRE(record.faults.bits() == 0);
  CHECK(rig.heap_calls() == 0);
  double sum = 0, largest = 0;
  int samples = 0;
  for (const PlantMeasurement& seen : rig.measurements()) {
    if (seen.stamp_ns < rig.motion()->path_start_ns()) continue;
    const double error_mm = 1e3 * (rig.motion()->at(seen.stamp_ns).position.head<3>() - seen.tip).norm();
    sum += error_mm;
    largest = std::max(largest, error_mm);
    ++samples;
  }
  REQUIRE(samples > 100);
  CAPTURE(sum / samples, largest);
  CHECK(sum / samples < kMean_mm);
  CHECK(largest < kMax_mm);
  // Every drive did its part, within its limits.
  const rt::TraceRecord& last = rig.trace().back();
  for (size_t a = 0; a < 4; ++a) {
    const ActuatorConfig& actuator = block.config.actuators[a];
    CAPTURE(actuator.name, last.command[a], last.lambda[a]);
    CHECK(std::abs(last.command[a]) > 1e-3 * actuator.displacement_max);
    CHECK(last.measured[a] == Approx(last.command[a]).margin(1e-2 * actuator.displacement_max));
    CHECK(last.lambda[a] <= actuator.effort_max);
    CHECK(last.lambda[a] >= actuator.effort_min);
  }
}

}  // namespace tendril::app::actuator_kinds_test
