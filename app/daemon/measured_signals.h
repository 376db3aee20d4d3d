// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "app/config/config.h"
#include "app/config/readings.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// The signals of the sensors, sorted by what they measure. Real-time: no, for all of it (allocates).
struct MeasuredSignals {
  explicit MeasuredSignals(const Config& config);

  std::vector<int> tip_axes;                    ///< that are controlled, see app::tip_axes()
  std::array<std::optional<Reading>, 3> tip;    ///< x, y, z of the first effector
  std::vector<std::optional<Reading>> efforts;  ///< one an actuator
  std::vector<Reading> others;                  ///< coordinates of the other effectors
};

/// Tells the first record that holds a sample from those that repeat it.
class NewSamples {
 public:
  /// Whether the record holds a sample of the sensor that the records before did not.
  bool has(const rt::TraceRecord& record, const Reading& reading) const {
    return record.sensors.stamp_ns[reading.sensor] > known_ns_[reading.sensor];
  }
  /// The record is done with.
  void pass(const rt::TraceRecord& record) { known_ns_ = record.sensors.stamp_ns; }

 private:
  std::array<int64_t, hal::kMaxSensors> known_ns_{};  // of each sensor's last sample
};

}  // namespace tendril::app
