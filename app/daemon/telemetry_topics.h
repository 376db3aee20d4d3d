// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "app/config/config.h"
#include "app/daemon/run_recorder.h"
#include "app/mcap/mcap_records.h"

namespace tendril::app {

/// The topics of a log, in the order of their channels; those of the sensors follow.
enum class Topic : uint16_t { kState, kTargets, kSnapshots, kErrors, kStatus, kLog, kEnd, kSensors };

/// Values that stand together in an object of JSON, like the coordinates of an effector. Names are in quotes.
struct ValueGroup {
  std::string name;
  std::vector<std::pair<std::string, std::size_t>> values;  ///< name, and place in the record
};

/// The controlled coordinates: {"tip": {"x": …}}, with their places in rt::EffectorVector.
std::vector<ValueGroup> coordinate_groups(const Config& config);

/// What each sensor measures: {"tip": {"x": …}, "north": {"effort": …}}, with the places of its signals in
/// hal::SensorReadings.
std::vector<std::vector<ValueGroup>> sensor_groups(const Config& config);

/// A text in quotes, as JSON has it. What is no UTF-8 in it is replaced.
std::string in_quotes(const std::string& text);

/// Schemas, channels and metadata of the log of a run; docs/logs.md describes them.
/// @param facts      what is known before the run
/// @param offset_ns  from CLOCK_MONOTONIC to the times of the log
McapContent telemetry_content(const Config& config, const RunFacts& facts, int64_t offset_ns);

}  // namespace tendril::app
