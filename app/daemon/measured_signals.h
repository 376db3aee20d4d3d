#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/config/config.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// Where what a sensor measures stands among the readings of a trace record.
struct SignalIndex {
  std::size_t sensor, signal;
};

/// Which signals of the sensors measure what. Real-time: no, for all of it (allocates).
struct MeasuredSignals {
  explicit MeasuredSignals(const Config& config);

  /// A coordinate of an effector other than the first.
  struct Other {
    SignalIndex index;
    std::string effector;
    int axis;  ///< 0 x, 1 y, 2 z
  };

  std::vector<int>
      tip_axes;  ///< of the first effector's controlled coordinates, in their order: 0 x, 1 y, 2 z
  std::array<std::optional<SignalIndex>, 3> tip;    ///< x, y, z of the first effector
  std::vector<std::optional<SignalIndex>> efforts;  ///< one an actuator
  std::vector<Other> others;
};

/// Tells the first record that holds a sample from those that repeat it.
class NewSamples {
 public:
  /// Whether the record holds a sample of the sensor that the records before did not.
  bool has(const rt::TraceRecord& record, const SignalIndex& index) const {
    return record.sensors.stamp_ns[index.sensor] > known_ns_[index.sensor];
  }
  /// The record is done with.
  void pass(const rt::TraceRecord& record) { known_ns_ = record.sensors.stamp_ns; }

 private:
  std::array<int64_t, hal::kMaxSensors> known_ns_{};  // of each sensor's last sample
};

}  // namespace tendril::app
