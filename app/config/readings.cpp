// SPDX-License-Identifier: Apache-2.0
#include "app/config/readings.h"

namespace tendril::app {

std::vector<Reading> readings(const Config& config) {
  std::vector<Reading> result;
  for (std::size_t s = 0; s < config.sensors.size(); ++s)
    for (const MeasuredConfig& measured : config.sensors[s].measures)
      result.push_back({static_cast<int>(s), static_cast<int>(result.size()), measured});
  return result;
}

}  // namespace tendril::app
