// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "app/config/config.h"
#include "app/robot/robot.h"
#include "rt/controller.h"
#include "rt/idle_latency_limit.h"

namespace tendril::app {

/// A robot that is ready to be controlled on this machine; nothing has touched its bus yet.
struct PreparedRobot {
  std::unique_ptr<Robot> robot;
  rt::EffectorVector rest;   ///< where effectors that do not move stay, e, m or m³
  rt::ControllerConfig law;  ///< with the iteration cap that this machine has time for
  bool memory_locked = false;
  std::unique_ptr<rt::IdleLatencyLimit> idle_latency_limit;  ///< holds while it lives; nothing where refused
};

/// Builds the model, takes the rights of real time, then times the QP. A stop signal meanwhile ends the
/// process, see ExitOnStopSignal.
/// @throws ConfigError; rt::RtError where memory cannot be locked and must be
/// Real-time: no (takes seconds).
PreparedRobot prepare_robot(const Config& config, bool allow_non_rt);

}  // namespace tendril::app
