// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <catch2/catch.hpp>
#include <fstream>
#include <optional>
#include <string>

#include "tests/hal/bus/raw_can.h"

namespace tendril::hal::testing {

/// True where there is no CAN interface vcan0, once the test has said that it is skipped for that; ctest
/// knows the sentence. tools/vcan runs a command where there is one.
inline bool skipped_without_vcan0() {
  // ARPHRD_CAN of linux/if_arp.h, which cannot be included beside net/if.h.
  constexpr int kHardwareCan = 280;
  std::ifstream type("/sys/class/net/vcan0/type");
  int value = 0;
  if (type >> value && value == kHardwareCan) return false;
  WARN("skipped: there is no vcan0 here; run the tests through tools/vcan");
  return true;
}

/// A virtual CAN interface that nobody else talks on: one of the test's own where it may make one. Else it is
/// vcan0, which the tests of a run use one after the other; where others talk on it, tests may fail.
class Vcan {
 public:
  Vcan() {
    if (OwnInterface::may_be_made()) own_.emplace();
  }
  std::string name() const { return own_ ? own_->name() : "vcan0"; }

 private:
  std::optional<OwnInterface> own_;
};

}  // namespace tendril::hal::testing
