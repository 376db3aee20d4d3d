// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "app/operation/control_request.h"
#include "app/operation/coordinates.h"
#include "tests/fuzz/inputs.h"

namespace tendril::fuzz {
namespace {

/// A tip that moves in x and z, and the volume of a chamber.
const app::Config& robot_with_chamber() {
  static const app::Config robot = [] {
    app::Config config;
    config.effectors = {{"tip", {}, {true, false, true}, {}, {1, 1}},
                        {"chamber", {}, {}, app::RegionConfig{}, {1}}};
    config.control.workspace_min = {-0.05, -0.05, 0.05};
    config.control.workspace_max = {0.05, 0.05, 0.15};
    config.motion.emplace();
    return config;
  }();
  return robot;
}

void check_target(const app::ControlRequest& request, const app::Config& config) {
  must(request.position.size() == 3 && request.velocity.size() == 3, "a target has all coordinates");
  must(request.velocity.allFinite(), "velocities are finite");
  for (const auto& value : request.position) must(!value || std::isfinite(*value), "positions are finite");
  const auto& control = config.control;
  for (const int row : {0, 1}) {
    const int axis = row == 0 ? 0 : 2;
    must(!request.position[row] || (*request.position[row] >= control.workspace_min[axis] &&
                                    *request.position[row] <= control.workspace_max[axis]),
         "targets lie in the workspace");
  }
}

int depth_of(const nlohmann::json& value) {
  int deepest = 0;
  if (!value.is_structured()) return deepest;
  for (const nlohmann::json& item : value) deepest = std::max(deepest, depth_of(item));
  return deepest + 1;
}

}  // namespace

bool feed_request(const std::string& bytes) {
  const app::Config& config = robot_with_chamber();
  try {
    const app::ControlRequest request = app::read_request(bytes, config, app::coordinate_names(config));
    if (request.command == app::Command::kTarget) check_target(request, config);
    must(depth_of(request.id) < 32, "what is taken is at most 32 levels deep");
    must(request.rate_hz >= 0 && request.rate_hz <= 1000, "states come at most at 1 kHz");
    must(!request.path_rate || (*request.path_rate >= 0 && *request.path_rate <= 1),
         "the rate of a path is from 0 to 1");
    return true;
  } catch (const app::RequestError& error) {
    static_cast<void>(error.id.dump());  // as the refusal does
    return false;
  }
}

}  // namespace tendril::fuzz
