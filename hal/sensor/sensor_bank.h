// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hal/sensor/sensor.h"

namespace tendril::hal {

/// Receives the frames of a robot's sensors and checks the age of their samples.
/// Real-time: every function but the constructor and `identifiers` (bounded, no allocation).
class SensorBank {
 public:
  /// @param sensors           pass `check`; outlive the bank
  /// @param start_timeout_ns  until the first frame of a sensor must have come, from the first `judge` on
  SensorBank(const std::vector<SensorConfig>& sensors, int64_t start_timeout_ns)
      : sensors_(sensors), start_timeout_ns_(start_timeout_ns) {}

  /// The identifiers of the sensors' frames, see marked_id. Real-time: no (allocates).
  std::vector<uint32_t> identifiers() const;

  /// Processes a frame of a sensor. One that is too short, or in which a float is not finite, is no sample.
  /// @return whether its identifier is a sensor's
  bool receive(const Frame& frame, int64_t arrival_ns) noexcept;

  /// Checks ages. After a pause between two calls that is longer than the timeout of a sensor, that timeout
  /// starts again: a pause of the controller is no fault of the sensor.
  /// @return valid until the next call
  const SensorReadings& judge(int64_t now_ns) noexcept;

 private:
  void take_in(size_t sensor, size_t first_signal, const Frame& frame, int64_t arrival_ns) noexcept;

  const std::vector<SensorConfig>& sensors_;
  int64_t start_timeout_ns_;
  int64_t started_ns_ = 0, judged_ns_ = 0;  // first and last `judge`; 0: none yet
  std::array<int64_t, kMaxSensors> pause_end_ns_{};
  SensorReadings readings_;
};

}  // namespace tendril::hal
