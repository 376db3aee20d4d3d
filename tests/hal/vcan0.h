#pragma once

#include <catch2/catch.hpp>
#include <fstream>
#include <string>

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

}  // namespace tendril::hal::testing
