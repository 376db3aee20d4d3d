// SPDX-License-Identifier: Apache-2.0
#include "app/plant/plant_line.h"

namespace tendril::app {

void PlantLine::send(hal::Bus& bus, std::span<const hal::Frame> frames, int64_t now_ns) noexcept {
  release(bus, now_ns);
  if (off_) return;
  if (delay_ns_ == 0 && loss_ == 0) {
    bus.send(frames);
    return;
  }
  for (const hal::Frame& frame : frames) {
    if (lost() || count_ == kWaiting) continue;
    waiting_[(first_ + count_) % kWaiting] = {frame, now_ns};
    ++count_;
  }
  release(bus, now_ns);
}

void PlantLine::release(hal::Bus& bus, int64_t now_ns) noexcept {
  for (; count_ > 0 && now_ns - waiting_[first_].since_ns >= delay_ns_; --count_) {
    if (!off_) bus.send(waiting_[first_].frame);
    first_ = (first_ + 1) % kWaiting;
  }
}

}  // namespace tendril::app
