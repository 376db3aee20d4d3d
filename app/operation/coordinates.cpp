// SPDX-License-Identifier: Apache-2.0
#include "app/operation/coordinates.h"

#include "app/robot/robot.h"

namespace tendril::app {

std::vector<std::string> coordinate_names(const Config& config) {
  static const char* const kAxes[] = {".x", ".y", ".z", ".volume"};
  std::vector<std::string> names;
  for (const EffectorRow& row : effector_rows(config))
    names.push_back(config.effectors[row.effector].name + kAxes[row.axis]);
  return names;
}

}  // namespace tendril::app
