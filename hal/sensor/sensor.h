// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/sensor/signal.h"

namespace tendril::hal {

/// Sensors of the largest robot, and what all of them measure together.
inline constexpr int kMaxSensors = 32;
inline constexpr int kMaxSensorSignals = 64;

/// A device that sends its measured values cyclically in one frame. Durations in ns.
struct SensorConfig {
  std::string name;                  // for people
  uint32_t id = 0;                   // of its frames: 11 bits, or 29 bits where `extended`
  bool extended = false;             // identifier format
  int length = 8;                    // bytes of data
  double rate_hz = 100;              // of its frames, for the bus budget
  int64_t timeout_ns = 100'000'000;  // an older sample is not fresh
  bool required = false;             // its loss ends the run
  std::vector<Signal> signals{};     // in SI units
  std::optional<Signal> age = {};    // s, from the measurement to the frame
};

/// The readings of all sensors. Signals are sensor by sensor in the order of the configuration.
struct SensorReadings {
  std::array<double, kMaxSensorSignals> value{};  // the last received, in SI units
  std::array<int64_t, kMaxSensors> stamp_ns{};    // when it was measured; 0: never
  std::array<bool, kMaxSensors> fresh{};          // measured within the sensor's timeout
  bool ready = true;                              // every required sensor is fresh
  int lost = -1;  // index of a required sensor whose time-out has expired; -1: there is none
};

/// Checks sensors: how many, identifiers, rates, time-outs, and that the signals of a frame fit into it side
/// by side. IdentifierClaims checks that no other node uses an identifier.
/// @throws std::invalid_argument with a sentence that names the sensor and what is expected
/// Real-time: no.
void check(const std::vector<SensorConfig>& sensors);

/// "sensor 'camera': no sample younger than 100 ms". Real-time: no (allocates).
std::string describe_loss(const SensorConfig& sensor);

/// The frame of a sample as its sensor sends it.
/// @param values  one a signal, in SI units
/// @param age_ns  from the measurement to the frame
/// @return        nothing where one of them or the age does not fit: no sample is better than a clipped one
/// Real-time: yes.
std::optional<Frame> encode_sample(const SensorConfig& sensor, std::span<const double> values,
                                   int64_t age_ns) noexcept;

}  // namespace tendril::hal
