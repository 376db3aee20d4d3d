// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/config/config.h"
#include "app/config/readings.h"
#include "hal/drive/drives.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// The state of a robot in one cycle, as the control protocol tells it: SI units, null for what is not known.
/// docs/control-protocol.md names the keys. Real-time: no.
class RobotState {
 public:
  /// Keeps references.
  /// @param master  puts faults into words
  RobotState(const Config& config, const hal::DriveMaster& master);

  nlohmann::ordered_json describe(const rt::TraceRecord& record) const;

  const std::vector<std::string>& coordinates() const { return coordinates_; }

 private:
  nlohmann::ordered_json by_coordinate(const double* values) const;
  nlohmann::ordered_json measured(const rt::TraceRecord& record) const;

  const Config& config_;
  const hal::DriveMaster& master_;
  std::vector<std::string> coordinates_;
  std::vector<Reading> readings_;
};

}  // namespace tendril::app
