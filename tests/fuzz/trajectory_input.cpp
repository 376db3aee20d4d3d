// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "app/client/trajectory.h"
#include "app/config/config_error.h"
#include "tests/fuzz/inputs.h"
#include "tests/fuzz/scratch.h"

namespace tendril::fuzz {

bool feed_trajectory(const std::string& bytes) {
  try {
    const app::Trajectory way(scratch_file("way.csv", bytes), {"tip.x", "tip.z", "chamber.volume"});
    must(std::isfinite(way.duration_s()) && way.duration_s() >= 0, "a trajectory ends");
    constexpr int kInstants = 16;
    for (int k = -1; k <= kInstants + 1; ++k) {
      const std::vector<double> point = way.at(k * way.duration_s() / kInstants);
      must(point.size() == way.names().size(), "a point has a value for each coordinate");
      must(std::ranges::all_of(point, [](double value) { return std::isfinite(value); }),
           "all points of a trajectory are finite");
    }
    return true;
  } catch (const app::ConfigError&) {
    return false;
  }
}

}  // namespace tendril::fuzz
