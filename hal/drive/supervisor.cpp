// SPDX-License-Identifier: Apache-2.0
#include "hal/drive/supervisor.h"

namespace tendril::hal {
namespace {

FaultKind fault_of(BusHealth health) noexcept {
  switch (health) {
    case BusHealth::kActive:
      return FaultKind::kNone;
    case BusHealth::kStalled:
      return FaultKind::kBusStalled;
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

/// A bus that is busy for a moment is none that has stalled.
void Supervisor::latch_bus(BusHealth health, int64_t now_ns) noexcept {
  if (health != BusHealth::kStalled)
    stalled_since_ns_ = 0;
  else if (stalled_since_ns_ == 0)
    stalled_since_ns_ = now_ns;
  if (health != BusHealth::kStalled || now_ns - stalled_since_ns_ > feedback_timeout_ns_)
    latch({.kind = fault_of(health)});
}

void Supervisor::latch(const DriveFault& fault) noexcept {
  DriveFault& latched = measurement_.fault;
  const bool same = latched.kind == fault.kind && latched.axis == fault.axis;
  // The same fault may come again with its code, where a CiA 402 statusword was faster than the EMCY.
  if (latched.kind == FaultKind::kNone || same) latched = fault;
}

}  // namespace tendril::hal
