#include "app/robot/control_stack.h"

#include <utility>

#include "hal/sensor/sensor.h"

namespace tendril::app {

ControlStack::ControlStack(const rt::ControllerConfig& law, std::unique_ptr<hal::DriveMaster> drives,
                           hal::Bus& bus)
    : master(std::move(drives)),
      controller(law),
      channels(std::make_unique<rt::Channels>()),
      loop(bus, *master, controller, *channels) {}

std::string ControlStack::stop_reason(const Config& config) const {
  if (!controller.faulted()) return "";
  switch (controller.stop_reason()) {
    case rt::Fault::kSensorLost:
      return hal::describe_loss(config.sensors[controller.lost_sensor()].frame);
    case rt::Fault::kDrives:
      return master->describe(controller.drive_fault());
    default:
      return rt::rule(controller.stop_reason()).words;
  }
}

}  // namespace tendril::app
