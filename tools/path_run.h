// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "app/config/config.h"
#include "tools/loops.h"

namespace tendril::tools {

/// Mean, 95 % quantile and largest of a run's errors.
struct Errors {
  double mean = 0, p95 = 0, max = 0;  ///< m
};

/// One run of a robot along the path of its file, as figures 4 to 6 of the paper look at it. Times count from
/// the start of the path.
struct PathRun {
  struct Seen {
    double t;                      ///< s
    Eigen::Vector3d tip, desired;  ///< m
    double error() const { return (tip - desired).norm(); }
  };
  struct Sent {
    double t;                          ///< s
    std::vector<double> displacement;  ///< commanded, one an actuator, m
  };
  std::vector<Seen> seen;  ///< after each time step of the simulated body
  std::vector<Sent> sent;  ///< in each control cycle

  Errors errors() const;

  /// How rough the commands are: the root mean square, over cycles and actuators, of their second
  /// differences at the control rate, m/s². A command at constant speed has none.
  double roughness() const;
};

/// Runs a robot in virtual time, until its tip has gone round its path so many times.
/// @param speed  of the tip on the path, m/s
/// @throws std::runtime_error where the robot has no closed path of a point, or the run ends before
/// Real-time: no.
PathRun run_path(app::Config config, double speed, double rounds, const Loops& loops);

}  // namespace tendril::tools
