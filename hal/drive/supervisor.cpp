#include "hal/drive/supervisor.h"

namespace tendril::hal {
namespace {

FaultKind fault_of(BusHealth health) noexcept {
  switch (health) {
    case BusHealth::kActive:
      return FaultKind::kNone;
    case BusHealth::kPassive:
      return FaultKind::kBusPassive;
    case BusHealth::kOff:
      return FaultKind::kBusOff;
    case BusHealth::kDown:
      break;
  }
  return FaultKind::kBusDown;
}

}  // namespace

std::string describe_power(const MasterConfig& config, const Measurement& measurement) {
  std::string on, unknown;
  for (int i = 0; i < measurement.axes; ++i) {
    std::string& list = measurement.power[i] == DrivePower::kOn ? on : unknown;
    if (measurement.power[i] != DrivePower::kOff) list += (list.empty() ? "" : ", ") + label(config.axes[i]);
  }
  std::string text;
  if (!on.empty()) text = on + " did not disable";
  if (!unknown.empty())
    text += (on.empty() ? "" : "; ") + unknown + " cannot be reached: whether it has power is not known";
  return text.empty() ? text : text + ". Drives stop by themselves when they miss the controller";
}

void Supervisor::latch_bus(BusHealth health) noexcept { latch({.kind = fault_of(health)}); }

void Supervisor::latch(const DriveFault& fault) noexcept {
  DriveFault& latched = measurement_.fault;
  const bool same = latched.kind == fault.kind && latched.axis == fault.axis;
  // The same fault may come again with its code, where a CiA 402 statusword was faster than the EMCY.
  if (latched.kind == FaultKind::kNone || same) latched = fault;
}

}  // namespace tendril::hal
