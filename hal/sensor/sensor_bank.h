#pragma once

#include <vector>

#include "hal/sensor/sensor.h"

namespace tendril::hal {

/// Listens to the sensors of a robot and judges how old is what they have told.
/// Real-time: every function but the constructor and `identifiers` (bounded, no allocation).
class SensorBank {
 public:
  /// @param sensors           as `check` wants them; outlive the bank
  /// @param start_timeout_ns  until a sensor must have been heard, from the first `judge` on
  SensorBank(const std::vector<SensorConfig>& sensors, int64_t start_timeout_ns)
      : sensors_(sensors), start_timeout_ns_(start_timeout_ns) {}

  /// The identifiers of the sensors' frames, see marked_id. Real-time: no (allocates).
  std::vector<uint32_t> identifiers() const;

  /// Takes in a frame of a sensor. One that is too short, or in which a float is not finite, is no sample.
  /// @return whether its identifier is a sensor's
  bool receive(const Frame& frame, int64_t arrival_ns) noexcept;

  /// Judges ages. A sensor is given its timeout anew where nobody judged for longer than that: a pause of
  /// ours is no fault of its.
  /// @return valid until the next call
  const SensorReadings& judge(int64_t now_ns) noexcept;

 private:
  void take_in(size_t sensor, size_t first_signal, const Frame& frame, int64_t arrival_ns) noexcept;

  const std::vector<SensorConfig>& sensors_;
  int64_t start_timeout_ns_;
  int64_t started_ns_ = 0, judged_ns_ = 0;  // first and last `judge`; 0: none yet
  std::array<int64_t, kMaxSensors> excused_ns_{};
  SensorReadings readings_;
};

}  // namespace tendril::hal
