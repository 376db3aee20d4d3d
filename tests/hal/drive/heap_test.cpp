// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <string>

#include "tests/hal/heap_count.h"
#include "tests/hal/rig.h"

namespace tendril::hal::heap_test {
using namespace tendril::hal::test;

#ifndef TENDRIL_SANITIZED

TEST_CASE("The heap counter counts", "[rt]") {
  const uint64_t before = heap_calls();
  const std::string text(100, 'x');
  CHECK(text.size() == 100);
  CHECK(heap_calls() > before);
}

/// From start-up over a fault and a reset to the farewell.
/// @return heap calls made meanwhile
template <class AnyRig>
uint64_t live(AnyRig& rig) {
  // The rig's own containers are reserved; what is left is master, drives, batches and bus.
  const auto cycles = [&rig](int count) {
    for (int i = 0; i < count; ++i) rig.cycle();
  };
  const uint64_t before = heap_calls();
  cycles(300);
  const bool known = rig.measured.all_known;
  rig.command.enable = true;
  cycles(200);
  const bool enabled = rig.measured.all_enabled;
  rig.drives[2].overheat();
  cycles(100);
  const bool failed = rig.measured.fault.kind == FaultKind::kDriveFault;
  rig.command.reset = true;
  cycles(1);
  rig.command.reset = false;
  cycles(400);
  const bool recovered = rig.measured.all_enabled;
  rig.command.enable = false;
  rig.command.finish = true;
  cycles(200);
  const bool finished = rig.measured.finished;
  const uint64_t made = heap_calls() - before;
  CHECK(known);
  CHECK(enabled);
  CHECK(failed);
  CHECK(recovered);
  CHECK(finished);
  return made;
}

TEST_CASE("A whole life of CiA 402 drives makes no heap call on either side", "[rt]") {
  Rig rig(config_of(4));
  CHECK(live(rig) == 0);
}

TEST_CASE("A whole life of CiA 402 drives that are homed makes no heap call on either side", "[rt]") {
  MasterConfig config = config_of(3);
  cia402_settings(config.axes[2]).reference = Reference::kHoming;
  cia402_settings(config.axes[2]).homing.method = 37;
  cia402_settings(config.axes[2]).referenced_bit = 14;
  for (AxisConfig& axis : config.axes) axis.displacement_min = -(axis.displacement_max = 1e-3);
  Rig rig(config);
  CHECK(live(rig) == 0);
}

TEST_CASE("A whole life of axes that follow efforts makes no heap call on either side", "[rt]") {
  Rig rig(on_efforts(config_of(4), 3, 10e-3));
  OdriveRig odrive(on_efforts(odrive_config_of(4), 3, 1));
  rig.command.effort.fill(0);
  CHECK(live(rig) == 0);
  CHECK(live(odrive) == 0);
}

TEST_CASE("A whole life of ODrive axes makes no heap call on either side", "[rt]") {
  OdriveRig rig(odrive_config_of(4));
  CHECK(live(rig) == 0);
}

#endif

}  // namespace tendril::hal::heap_test
