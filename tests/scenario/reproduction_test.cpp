// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "tests/scenario/robot_files.h"
#include "tools/coupling_variation.h"
#include "tools/path_run.h"

// What the paper found [Largilliere 2015, section IV], on the demo's robot; tools/reproduce has the figures.

namespace tendril::tools::reproduction_test {

constexpr double kErrorRatio = 4;       // of one loop to two at 15 Hz; the paper's robot: 1.3
constexpr double kRoughnessRatio = 10;  // likewise
constexpr double kFell = 0.98;          // a change may be so much smaller at the next higher speed
constexpr double kLimit = 0.1;          // the change that the paper accepts
// The speed at which the limit is passed, over the model's rate: so far may it be from that at 15 Hz.
constexpr double kProportion = 1.3;
constexpr double kSeveralFold = 2;  // less error with the semidefinite tangent, where the tip is fast

const Eigen::Vector3d kUpwards(0, 0, 10e-3);  // m
const std::vector<double> kSteps{0.4e-3, 0.8e-3, 1.5e-3, 2.5e-3,
                                 3.5e-3};  // m, ways of the tip between two snapshots
constexpr fem::Tangent kPapers = fem::Tangent::kSemidefinite;

std::vector<double> changes(const Loops& loops) {
  std::vector<double> largest;
  for (const double step : kSteps)
    largest.push_back(
        variation_on_line(app::testing::diamond(), kUpwards, step * loops.model_rate_hz, loops).largest);
  return largest;
}

TEST_CASE("With two loops the error is smaller and the commands are smoother than with one", "[figures]") {
  const app::Config config = app::testing::diamond();
  const double jitter = GENERATE(0.0, 0.5);
  const PathRun one = run_path(config, config.motion->speed, 0.5, {15, true, jitter});
  const PathRun two = run_path(config, config.motion->speed, 0.5, {15, false, jitter});
  CAPTURE(jitter, one.errors().mean, two.errors().mean, one.roughness(), two.roughness());
  CHECK(one.errors().mean > kErrorRatio * two.errors().mean);
  CHECK(one.roughness() > kRoughnessRatio * two.roughness());
}

TEST_CASE("The command of the one loop stands still between its steps", "[figures]") {
  const app::Config config = app::testing::diamond();
  const PathRun run = run_path(config, config.motion->speed, 0.25, {15, true});
  std::size_t moved = 0;
  for (std::size_t k = 1; k < run.sent.size(); ++k)
    if (std::abs(run.sent[k].displacement[0] - run.sent[k - 1].displacement[0]) > 1e-9) ++moved;
  const double steps = 15 * run.sent.back().t;
  CAPTURE(moved, steps, run.sent.size());
  CHECK(std::abs(static_cast<double>(moved) - steps) <= 1);
}

TEST_CASE("In the one loop the model moves under the efforts that follow from its last snapshot",
          "[scenario]") {
  app::VirtualRig rig(app::testing::finger(), {.model_rate_hz = 15, .synchronous = true});
  std::map<uint64_t, rt::ActuatorVector> moved_under;  // by the number of the snapshot after the move
  rig.observe_snapshots([&](const rt::Snapshot& s) { moved_under[s.sequence] = s.lambda; });
  rig.run_for(1.5);
  int compared = 0;
  for (std::size_t k = 1; k < rig.trace().size(); ++k) {
    const rt::TraceRecord& first = rig.trace()[k];  // of the cycles with a snapshot
    if (!first.qp_solved || first.snapshot_sequence == rig.trace()[k - 1].snapshot_sequence) continue;
    const auto next = moved_under.find(first.snapshot_sequence + 1);
    if (next == moved_under.end()) continue;
    CHECK(next->second == Eigen::Map<const Eigen::Vector2d>(first.lambda.data()));
    ++compared;
  }
  CHECK(compared > 10);
}

TEST_CASE("Periods of the model that jitter stay within their share, and are the same at every run",
          "[figures]") {
  const auto stamps = [](uint32_t seed) {
    app::VirtualRig rig(app::testing::finger(),
                        {.model_rate_hz = 50, .model_jitter = 0.5, .jitter_seed = seed});
    std::vector<int64_t> found;
    rig.observe_snapshots([&](const rt::Snapshot& s) { found.push_back(s.stamp_ns); });
    rig.run_for(2);
    return found;
  };
  const std::vector<int64_t> found = stamps(1);
  REQUIRE(found.size() > 50);
  int64_t shortest = found.back(), longest = 0;
  for (std::size_t k = 1; k < found.size(); ++k) {
    shortest = std::min(shortest, found[k] - found[k - 1]);
    longest = std::max(longest, found[k] - found[k - 1]);
  }
  CHECK(shortest >= 10'000'000);
  CHECK(shortest < 12'000'000);
  CHECK(longest > 28'000'000);
  CHECK(longest <= 30'000'000);
  CHECK(found == stamps(1));
  CHECK(found != stamps(2));
}

TEST_CASE("The QP's matrix changes the more from snapshot to snapshot the faster the tip goes", "[figures]") {
  const auto tangent = GENERATE(fem::Tangent{kPapers}, fem::Tangent::kExact);
  const std::vector<double> found = changes({15, true, 0, tangent});
  CAPTURE(found);
  for (std::size_t k = 1; k < found.size(); ++k) CHECK(found[k] > kFell * found[k - 1]);
  CHECK(found.back() > 2 * found.front());
}

TEST_CASE("The speed at which the QP's matrix changes by 10 % grows in proportion to the model's rate",
          "[figures]") {
  const auto tangent = GENERATE(fem::Tangent{kPapers}, fem::Tangent::kExact);
  double first = 0;
  for (const double rate : {15.0, 30.0, 60.0}) {
    const double way = speed_at(kLimit, kSteps, changes({rate, true, 0, tangent}));
    CAPTURE(rate, way);
    REQUIRE(std::isfinite(way));
    if (first == 0) first = way;
    CHECK(way < kProportion * first);
    CHECK(first < kProportion * way);
  }
}

TEST_CASE("A tip that is fast for the model's rate strays with the exact tangent, less with the semidefinite",
          "[figures]") {
  const app::Config config = app::testing::diamond();
  const double exact = run_path(config, 0.06, 1, {15, false}).errors().mean;
  const double semidefinite = run_path(config, 0.06, 1, {15, false, 0, kPapers}).errors().mean;
  CAPTURE(exact, semidefinite);
  CHECK(exact > kSeveralFold * semidefinite);
}

}  // namespace tendril::tools::reproduction_test
