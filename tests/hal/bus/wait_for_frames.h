// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <catch2/catch.hpp>
#include <span>

#include "hal/bus/bus.h"
#include "tests/patience.h"

namespace tendril::hal::testing {

inline bool becomes_readable(const Bus& bus) {
  pollfd descriptor{bus.descriptor(), POLLIN, 0};
  return ::poll(&descriptor, 1, static_cast<int>(1e3 * tendril::testing::kPatience_s)) == 1;
}

/// Receives that many frames: the kernel usually delivers at once, but may take its time.
/// @return fewer where no more come
inline int wait_for(Bus& bus, std::span<Frame> frames, int wanted) {
  int count = bus.receive(frames);
  while (count < wanted && becomes_readable(bus)) count += bus.receive(frames.subspan(count));
  return count;
}

inline bool wait_for(Bus& bus, Frame& frame) { return wait_for(bus, std::span(&frame, 1), 1) == 1; }

/// Reads what is no data frame.
inline void read_error(Bus& bus) {
  REQUIRE(becomes_readable(bus));
  Frame frame;
  CHECK_FALSE(bus.receive(frame));
}

}  // namespace tendril::hal::testing
