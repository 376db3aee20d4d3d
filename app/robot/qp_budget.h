// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/robot/robot.h"

namespace tendril::app {

/// How many iterations of the QP a cycle has time for, on this machine.
struct QpBudget {
  double iteration_s = 0;  ///< what one takes
  int cap = 0;  ///< of the iterations in a cycle: what the file says, else as many as fit and are of use
  std::string
      text;  ///< "an iteration costs 0.4 us here; ...; cap 64, ..."; says what to change unless it fits
};

/// Time that an iteration of the QP takes on this machine at this moment, s: a high quantile over problems of
/// the robot at rest whose limits conflict, each from an empty working set to the cap. Only time on the CPU
/// counts, as what else runs here now the control thread will not wait for.
/// @throws ConfigError where the model cannot be linearised
/// Real-time: no (settles the body, then solves 800 problems).
double time_iteration(const Robot& robot, const Config& config);

/// What follows from that time for the cap.
/// @param iteration_s  > 0
/// @throws ConfigError where the file leaves the cap open and fewer fit than eight, and four for each
/// actuator Real-time: no (allocates).
QpBudget judge_qp(const Config& config, double iteration_s);

/// Limits of the controller as the robot file gives them, with the iteration cap that this machine has time
/// for.
/// @throws ConfigError as the two functions above
/// Real-time: no.
rt::ControllerConfig controller_config_for_this_machine(const Robot& robot, const Config& config);

}  // namespace tendril::app
