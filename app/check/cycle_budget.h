// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/robot/qp_budget.h"
#include "app/robot/robot.h"

namespace tendril::app {

/// Time on the CPU that the stages of a control cycle take, s.
struct CycleCost {
  double read_s = 0;   ///< taking in what the bus has brought
  double solve_s = 0;  ///< snapshot, target, limits and a QP that ends in a few iterations
  double write_s = 0;  ///< handing the drives' frames to the bus
};

/// Measures them on this machine at this moment: a high quantile over cycles of the daemon's own loop, with
/// the robot at rest and simulated drives on a local socket, which stands in for the CAN interface. As with
/// time_iteration(), what else runs here does not count.
/// @throws ConfigError where the drives cannot be brought to follow
/// Real-time: no (settles the body, then runs some seconds of virtual time).
CycleCost time_cycle(const Robot& robot, const Config& config);

/// A control cycle as it may be at worst, against the time there is for it.
struct CycleBudget {
  double whole_s = 0;  ///< all stages, with the QP at its cap
  double margin = 0;   ///< share of the cycle that is left for the wake-up and all else
  std::string text;    ///< "read 5 us, ...: 30 of 1667 us, 98 % left"; says what to change where little is
};

/// @throws ConfigError where the cycle does not fit into its period
/// Real-time: no (allocates).
CycleBudget judge_cycle(const Config& config, const CycleCost& cost, const QpBudget& qp);

}  // namespace tendril::app
