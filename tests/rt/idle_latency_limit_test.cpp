// SPDX-License-Identifier: Apache-2.0
#include "rt/idle_latency_limit.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <optional>

#include "rt/rt_error.h"
#include "tests/own_folder.h"

namespace tendril::rt::idle_latency_limit_test {

constexpr const char* kDevice = "/dev/cpu_dma_latency";

/// The limit that holds now, of all that were asked for, us; nothing where we may not ask.
std::optional<int32_t> limit_in_force() {
  const int device = open(kDevice, O_RDONLY | O_CLOEXEC);
  int32_t limit_us = 0;
  const bool known = device >= 0 && read(device, &limit_us, sizeof limit_us) == sizeof limit_us;
  if (device >= 0) close(device);
  return known ? std::optional(limit_us) : std::nullopt;
}

TEST_CASE("The kernel holds an IdleLatencyLimit as long as the object lives", "[rt]") {
  const auto before = limit_in_force();
  if (!before || access(kDevice, W_OK) != 0) {
    WARN("skipped: " << kDevice << " cannot be read and written here");
    return;
  }
  const int32_t limit_us = 7;
  {
    const IdleLatencyLimit limit(limit_us);
    CHECK(limit_in_force() == std::min(*before, limit_us));
  }
  CHECK(limit_in_force() == *before);
}

TEST_CASE("IdleLatencyLimit says what to grant where it is refused", "[unit]") {
  const tendril::testing::OwnFolder folder;
  const std::string device = folder / "latency";
  CHECK_THROWS_AS(IdleLatencyLimit(0, device), RtError);
  CHECK_THROWS_WITH(IdleLatencyLimit(0, device),
                    Catch::Contains(device) && Catch::Contains("No such file") && Catch::Contains("grant"));
}

}  // namespace tendril::rt::idle_latency_limit_test
