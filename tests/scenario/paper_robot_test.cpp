#include <catch2/catch.hpp>
#include <fstream>
#include <sstream>

#include "app/inverse_statics.h"
#include "tests/scenario/robot_files.h"

// The robot of Largilliere et al. (2015) on its own mesh, which lives outside the project
// (TENDRIL_SHARED_DATA).

namespace tendril::app {
namespace {

// SOFA's corotational frame and its mapping of points outside the mesh differ from ours.
constexpr double kPosition_mm = 0.1, kLength_mm = 1.0;
constexpr double kSquareMean_mm = 1.5, kSquareMax_mm = 3.0;

const std::filesystem::path kFolder = std::filesystem::path(TENDRIL_SHARED_DATA) / "diamond";

bool absent() {
  if (std::filesystem::exists(kFolder / "diamond.vtu")) return false;
  WARN("skipped: no reference data at " << kFolder.string() << " (CMake: TENDRIL_SHARED_DATA)");
  return true;
}

/// The YAML with the mesh where it is.
Config paper_diamond() {
  std::ifstream in(std::filesystem::path(TENDRIL_SOURCE_DIR) / "tests/scenario/paper_diamond.yaml");
  std::string text(std::istreambuf_iterator<char>(in), {});
  const std::string key = "../../../shared/data/diamond/diamond.vtu";
  text.replace(text.find(key), key.size(), (kFolder / "diamond.vtu").string());
  const auto file =
      std::filesystem::temp_directory_path() / ("tendril-paper-diamond-" + std::to_string(getpid()));
  std::ofstream(file) << text;
  const Config config = load_config(file);
  std::filesystem::remove(file);
  return config;
}

TEST_CASE("Goals of the paper's robot are reached with the lengths that SOFA's inverse model finds",
          "[scenario]") {
  if (absent()) return;
  const Config config = paper_diamond();
  const auto robot = build_model(config);
  std::ifstream in(kFolder / "inverse_sofa.csv");
  std::string line;
  std::getline(in, line);
  int goals = 0;
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream cells(line);
    Eigen::Vector3d goal, effector;
    Eigen::Vector4d force, length;
    for (double* cell = goal.data(); cell != goal.data() + 3; ++cell) cells >> *cell;
    for (double* cell = effector.data(); cell != effector.data() + 3; ++cell) cells >> *cell;
    for (double* cell = force.data(); cell != force.data() + 4; ++cell) cells >> *cell;
    for (double* cell = length.data(); cell != length.data() + 4; ++cell) cells >> *cell;
    const StaticReach reached =
        reach(*robot, controller_config(config), config.control.epsilon, rt::EffectorVector(1e-3 * goal));
    REQUIRE(reached.converged);
    INFO("goal " << goal.transpose() << " mm; found " << 1e3 * reached.p_e.transpose() << " mm with lengths "
                 << 1e3 * reached.delta_a.transpose() << " mm, SOFA " << effector.transpose() << " mm with "
                 << length.transpose() << " mm");
    CHECK((1e3 * reached.p_e - effector).norm() < kPosition_mm);
    CHECK((1e3 * reached.delta_a - length).cwiseAbs().maxCoeff() < kLength_mm);
    ++goals;
  }
  CHECK(goals == 7);
}

TEST_CASE("The paper's robot follows the square", "[scenario]") {
  if (absent()) return;
  const Config config = paper_diamond();
  VirtualRig rig(config, {.model_rate_hz = 15});  // the paper's rate
  rig.run_for(4);
  REQUIRE(rig.phase() == rt::Phase::kRunning);
  for (const rt::TraceRecord& record : rig.trace()) CHECK(record.faults.bits() == 0);
  const auto errors = testing::tracking_errors_mm(config, rig);
  CAPTURE(testing::mean(errors), testing::largest(errors));
  CHECK(testing::mean(errors) < kSquareMean_mm);
  CHECK(testing::largest(errors) < kSquareMax_mm);
  CHECK(testing::within_limits(config, rig.trace()));
}

}  // namespace
}  // namespace tendril::app
