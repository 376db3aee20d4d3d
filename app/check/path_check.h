// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/check/waypoint_check.h"
#include "app/config/config.h"
#include "app/robot/motion.h"
#include "rt/faults.h"

namespace tendril::app {

/// Closed paths of short rounds go round as long as this.
inline constexpr double kLeastOfPath_s = 2;  // of virtual time
/// No more of a path than this is simulated.
inline constexpr double kSimulatedPath_s = 10;  // of virtual time, the approach included

/// An instant on the path.
struct PathInstant {
  double time_s = 0;  ///< since the path began at the first waypoint; below 0 on the approach
  PathPart part;
};

/// What the path asks of one actuator.
struct ActuatorDemand {
  double top_speed = 0;               ///< the greatest that was commanded, mean over 20 ms, m/s or m³/s
  double at_top_speed_s = 0;          ///< for so long it was commanded as fast as it may move
  std::optional<PathInstant> first;   ///< when that began
  std::optional<double> asked_speed;  ///< the greatest it would need to keep to the path, where it was at it
};

/// A fault that the run got over.
struct PathFault {
  rt::Fault fault;
  int64_t cycles = 0;
  PathInstant first;
};

/// How far the model strays from the path when the controller follows it.
struct PathCheck {
  double model_rate_hz = 0;
  double approach_s = 0, round_s = 0;                            ///< of the path: as Motion has them
  double covered_s = 0;                                          ///< of the path itself, without the approach
  double error_mean = 0, error_max = 0, approach_error_max = 0;  ///< from target to model, m
  PathInstant worst;                                             ///< on the path
  std::optional<PathInstant> first_off;  ///< on the path, where the error first passes kReached
  std::vector<AtLimit> at_limits;        ///< at the worst instant
  std::vector<ActuatorDemand> actuators;
  std::vector<PathFault> faults;
  bool started = false;     ///< the simulated drives came to follow; else nothing is known of the path
  std::string stop_reason;  ///< what ended the run early; else empty

  bool whole() const { return covered_s >= 0.999 * round_s; }
  bool follows() const { return !started || (stop_reason.empty() && error_max <= kReached); }
};

/// Runs controller, model and simulated drives over the path in virtual time, with a body of the controller's
/// own parameters: the approach, then a round or more, or to the end, but no more than kSimulatedPath_s. The
/// model is refreshed 60 times a second, or so often as this machine can.
/// @param config     with a path
/// @param refresh_s  what a refresh of the model takes here
/// @param progress   told now and then how much is done, 0 to 1
/// @throws ConfigError
/// Real-time: no (runs some seconds of virtual time).
PathCheck check_path(const Config& config, double refresh_s, const std::function<void(double)>& progress);

/// "at 1.23 s, on the way from waypoint 2 to waypoint 3".
std::string describe(const PathInstant& instant, const Config& config);

/// What a person should know of it: "the model stays within 0.12 mm of the path, ...".
std::string verdict(const Config& config, const PathCheck& path);

/// What is worth a second look although the model keeps to its path, or why it does not; a sentence each.
std::vector<std::string> advice_on_path(const Config& config, const PathCheck& path);

/// All of it for machines: lengths in mm, speeds in the unit beside them.
nlohmann::ordered_json json_of(const Config& config, const PathCheck& path);

}  // namespace tendril::app
