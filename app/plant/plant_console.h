// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "app/config/config.h"
#include "app/config/plant_fault.h"

namespace tendril::app {

/// Standard input of tendril-plant: a line for each fault to inject, `help` for what there is.
/// Real-time: no (waits, allocates, writes).
class PlantConsole {
 public:
  /// @param config  outlives the console
  explicit PlantConsole(const Config& config);

  /// Waits for lines, answers those that are no faults, and logs the others.
  /// @param timeout_ms  how long, at most; it waits that long also where the input has ended
  /// @return  the faults that were asked for, in their order
  std::vector<PlantFault> read(int timeout_ms);

 private:
  void obey(const std::string& line, std::vector<PlantFault>& faults) const;

  const Config& config_;
  std::string pending_;  // of a line that is not complete yet
  bool ended_ = false;
};

}  // namespace tendril::app
