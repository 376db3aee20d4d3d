// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "app/config/config.h"

namespace tendril::app {

/// A signal of a sensor: where it stands in hal::SensorReadings, and what it measures.
struct Reading {
  int sensor;  ///< index in SensorReadings::stamp_ns
  int signal;  ///< index in SensorReadings::value
  MeasuredConfig measures;
};

/// All signals of all sensors, in the order of hal::SensorReadings. Real-time: no (allocates).
std::vector<Reading> readings(const Config& config);

}  // namespace tendril::app
