// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <filesystem>

#include "tests/scenario/paper_diamond.h"
#include "tests/scenario/robot_files.h"

// The robot of Largilliere et al. (2015) on its own mesh, which lives outside the project
// (TENDRIL_SHARED_DATA).

namespace tendril::app::paper_robot_test {

constexpr double kSquareMean_mm = 1.5, kSquareMax_mm = 3.0;

const std::filesystem::path kFolder = std::filesystem::path(TENDRIL_SHARED_DATA) / "diamond";

bool absent() {
  if (std::filesystem::exists(kFolder / "diamond.vtu")) return false;
  WARN("skipped: no reference data at " << kFolder.string() << " (CMake: TENDRIL_SHARED_DATA)");
  return true;
}

TEST_CASE("The paper's robot follows the square", "[scenario]") {
  if (absent()) return;
  const Config config = testing::paper_diamond(kFolder);
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

}  // namespace tendril::app::paper_robot_test
