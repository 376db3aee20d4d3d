#include "hal/supervisor.h"

#include "hal/tracker.h"

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

bool Supervisor::receive_tracker(const Frame& frame, int64_t arrival_ns) noexcept {
  if (config_.tracker_id == 0 || frame.id != config_.tracker_id || frame.extended) return false;
  if (const auto sample = decode_tracker(frame)) {
    measurement_.tracker_position = sample->position;
    measurement_.tracker_stamp_ns = arrival_ns - sample->age_ns;
  }
  return true;
}

void Supervisor::latch_bus(BusHealth health) noexcept { latch({.kind = fault_of(health)}); }

void Supervisor::latch(const DriveFault& fault) noexcept {
  DriveFault& latched = measurement_.fault;
  const bool same = latched.kind == fault.kind && latched.axis == fault.axis;
  // The same fault again may bring more, where a CiA 402 statusword was faster than the EMCY.
  if (latched.kind == FaultKind::kNone || same) latched = fault;
}

}  // namespace tendril::hal
