// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/prepared_robot.h"

#include "app/program/real_time_rights.h"
#include "app/program/stop_signal.h"
#include "app/robot/inverse_statics.h"
#include "app/robot/qp_budget.h"

namespace tendril::app {

PreparedRobot prepare_robot(const Config& config, bool allow_non_rt) {
  const ExitOnStopSignal starting;
  PreparedRobot prepared;
  prepared.robot = build_model(config);
  prepared.rest = effectors_at_rest(*prepared.robot);
  prepared.memory_locked = lock_memory(allow_non_rt);
  prepared.idle_latency_limit = limit_idle_latency(config.control.idle_latency);
  prepared.law = controller_config_for_this_machine(*prepared.robot, config);
  return prepared;
}

}  // namespace tendril::app
