// SPDX-License-Identifier: Apache-2.0
#include "app/robot/control_stack.h"

#include <utility>

#include "hal/sensor/sensor.h"

namespace tendril::app {

ControlStack::ControlStack(const rt::ControllerConfig& law, std::unique_ptr<hal::DriveMaster> drives,
                           hal::Bus& bus)
    : master(std::move(drives)),
      controller(law),
      channels(std::make_unique<rt::Channels>()),
      loop(bus, *master, controller, *channels) {
  bus.limit_waiting(hal::kWaitingCycles * hal::frames_in_cycle(law.actuators));
}

std::string ControlStack::stop_reason(const Config& config) const {
  return describe(controller.latched(), config, *master);
}

std::string describe(const rt::LatchedFault& fault, const Config& config, const hal::DriveMaster& master) {
  if (!fault.present) return "";
  switch (fault.fault) {
    case rt::Fault::kSensorLost:
      return hal::describe_loss(config.sensors[fault.lost_sensor].frame);
    case rt::Fault::kDrives:
      return master.describe(fault.drive);
    default:
      return rt::rule(fault.fault).words;
  }
}

}  // namespace tendril::app
