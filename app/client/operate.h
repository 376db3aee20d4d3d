// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tendril::app {

/// What `tendrilctl` is to ask of a running daemon.
struct OperateOptions {
  std::string command;               ///< status, faults, monitor, target, play, ..., see tendrilctl --help
  std::filesystem::path socket;      ///< empty: the only one in /run/tendril
  std::vector<double> position_mm;   ///< of target: one a coordinate of the first effector
  std::optional<double> speed_mm_s;  ///< of target, and of play with a shape
  std::optional<double> in_s;        ///< of target
  std::filesystem::path trajectory;  ///< of play; empty: the path of the robot file
  std::string shape;                 ///< of play, instead of a trajectory: a word of kShapes
  std::vector<double> size_mm;       ///< of the shape: width and height, or one for both
  std::string plane = "xy";          ///< of the shape: a word of kPlanes
  std::vector<double> centre_mm;     ///< of the shape, in its plane; empty: where the target is
  int turns = 1;                     ///< of the shape
  bool loop = false;                 ///< of play: again and again
  double percent = 100;              ///< of speed, and of play with a trajectory
  double rate_hz = 10;               ///< of monitor
  bool steal = false, watch = false, json = false;
};

/// Asks it, and prints the answer.
/// @return  exit code: 0 done, 1 the daemon refused
/// @throws std::runtime_error where no daemon answers
/// Real-time: no.
int operate(const OperateOptions& options);

}  // namespace tendril::app
