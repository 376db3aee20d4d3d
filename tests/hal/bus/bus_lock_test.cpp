// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/bus_lock.h"

#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <memory>

#include "hal/bus/bus.h"

namespace tendril::hal::bus_lock_test {

TEST_CASE("A bus has one controller on a machine, and the next one once that is gone", "[unit]") {
  const std::string bus = "can" + std::to_string(::getpid());
  auto first = std::make_unique<BusLock>(bus);
  CHECK_THROWS_WITH(BusLock(bus), Catch::StartsWith(bus + ": another tendrild or tendrilctl (process " +
                                                    std::to_string(::getpid()) + ")"));
  const BusLock other(bus + "2");
  first.reset();
  const BusLock next(bus);
}

TEST_CASE("A local bus is the same by whatever path it is reached", "[unit]") {
  const std::string folder = "/tmp", name = "bus" + std::to_string(::getpid());
  const BusLock first("local:" + folder + "/" + name);
  CHECK_THROWS_AS(BusLock("local:" + folder + "/../tmp/./" + name), BusError);
  const BusLock other("local:" + folder + "/" + name + std::string(200, 'x'));
}

TEST_CASE("A process that is killed leaves no lock behind", "[unit]") {
  const std::string bus = "can" + std::to_string(::getpid());
  const pid_t child = ::fork();
  if (child == 0) {
    const BusLock lock(bus);
    ::kill(::getpid(), SIGKILL);
  }
  ::waitpid(child, nullptr, 0);
  const BusLock lock(bus);
}

}  // namespace tendril::hal::bus_lock_test
