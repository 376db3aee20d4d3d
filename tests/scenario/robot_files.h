// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/config/config.h"
#include "app/virtual_time/virtual_rig.h"

namespace tendril::app::testing {

/// A robot of config/, by name.
Config shipped(const std::string& robot);
/// The finger is small, so most scenarios play on it.
Config finger();
Config diamond();

/// A robot file of config/ as it would be written for ODrive axes on the same nodes.
/// @param firmware  "0.5" or "0.6"
std::string odrive_yaml(const std::string& robot, const std::string& firmware = "0.6");
Config with_odrive(const std::string& robot, const std::string& firmware = "0.6");

/// The same robot with some axes on efforts, with drives whose rated torque is that of the largest effort.
Config on_efforts(Config config, const std::vector<int>& axes);

/// True where every command of the trace keeps to strokes and top speeds, but for rounding.
bool within_limits(const Config& config, const std::vector<rt::TraceRecord>& trace);

/// True where every effort of the trace is finite and, from when drives are enabled on, within its limits.
bool within_effort_limits(const Config& config, const std::vector<rt::TraceRecord>& trace);

/// Distances of the simulated tip from the wanted one in the first effector's controlled coordinates, at
/// every time step of the body on the path, mm.
std::vector<double> tracking_errors_mm(const Config& config, const VirtualRig& rig);

/// How far the model's effector coordinate e was from the wanted one at most, on the path, mm or ml.
double largest_model_error(const VirtualRig& rig, int e);

/// Silence after which a drive or the controller counts as lost, s.
double heartbeat_timeout_s(const Config& config);

double mean(const std::vector<double>& values);
double largest(const std::vector<double>& values);

}  // namespace tendril::app::testing
