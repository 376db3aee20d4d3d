// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <string>

#include "hal/drive/drive_protocol.h"
#include "tests/hal/rig.h"

// The end of a run: no drive that has power is called off, whatever has happened to the bus before.

namespace tendril::hal::finish_test {

using test::config_of, test::EnabledOdriveRig, test::EnabledRig, test::odrive_config_of;

constexpr int64_t kMillisecond_ns = 1'000'000;
constexpr int64_t kLongest_ns = 3'000 * kMillisecond_ns;

template <class AnyRig>
void finish(AnyRig& rig) {
  rig.command.enable = false;
  rig.command.finish = true;
}

/// Every axis is told as what it is: off only where it is off, else by name.
template <class AnyRig>
void check_told(const MasterConfig& config, const AnyRig& rig) {
  const std::string told = describe_power(config, rig.measured);
  for (size_t i = 0; i < rig.drives.size(); ++i) {
    CAPTURE(i, rig.measured.finished, rig.measured.power[i], told);
    const bool on = rig.drives[i].power_stage() == PowerStage::kOn;
    CHECK_FALSE((on && rig.measured.power[i] == DrivePower::kOff));
    CHECK((told.find(label(config.axes[i])) != std::string::npos) ==
          (rig.measured.power[i] != DrivePower::kOff));
    if (rig.measured.all_disabled) CHECK_FALSE(on);
  }
}

/// The bus fails, is reset while it is away, and comes back or not; the run is ended at any instant of this.
template <class AnyRig>
void try_ends(const MasterConfig& config) {
  const auto seed = GENERATE(range(1u, 25u));
  CAPTURE(seed, config.protocol->name());
  std::mt19937 random(seed);
  const auto up_to_ms = [&](int64_t most) { return kMillisecond_ns * (random() % most); };
  AnyRig rig(config);
  rig.controller.set_health(random() % 2 ? BusHealth::kOff : BusHealth::kDown);
  rig.run_for(kMillisecond_ns + up_to_ms(600));
  rig.command.reset = true;
  rig.cycle();
  rig.command.reset = false;
  const bool before_return = random() % 2, returns = random() % 4 != 0;
  if (before_return) {
    rig.run_for(up_to_ms(400));
    finish(rig);
    rig.run_for(up_to_ms(200));
  }
  check_told(config, rig);
  if (returns) rig.controller.set_health(BusHealth::kActive);
  if (!before_return) {
    rig.run_for(up_to_ms(1'500));
    finish(rig);
  }
  const bool finished = rig.run_until(
      [&] {
        check_told(config, rig);
        return rig.measured.finished;
      },
      kLongest_ns);
  CAPTURE(before_return, returns, finished);
  check_told(config, rig);
  if (!returns) CHECK_FALSE(rig.measured.all_disabled);
  if (returns && !before_return) {
    CHECK(finished);
    CHECK(describe_power(config, rig.measured).empty());
  }
  rig.run_for(500 * kMillisecond_ns);
  check_told(config, rig);
}

TEST_CASE("After a reset on a bus that is away, a CiA 402 drive with power is never called off", "[law]") {
  try_ends<EnabledRig>(config_of(2));
}

TEST_CASE("After a reset on a bus that is away, an ODrive axis with power is never called off", "[law]") {
  try_ends<EnabledOdriveRig>(odrive_config_of(2));
}

TEST_CASE("An ODrive axis whose order to be idle is lost is not called off by a heartbeat from before it",
          "[law]") {
  test::OdriveRig rig(odrive_config_of(1));
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.command.enable = true;
  REQUIRE(rig.run_until([&] { return rig.drives[0].state() == kOdriveClosedLoop; }));
  finish(rig);
  rig.plugs[0]->set_plugged(false);
  rig.cycle();  // its order to be idle, which is lost
  CHECK(rig.measured.power[0] != DrivePower::kOff);
  rig.plugs[0]->set_plugged(true);
  rig.run_until([&] {
    check_told(odrive_config_of(1), rig);
    return rig.measured.finished;
  });
  CHECK(rig.measured.finished);
  CHECK(rig.drives[0].power_stage() != PowerStage::kOn);
}

TEST_CASE("A second end of a run gives drives as long to disable by PDO as the first", "[law]") {
  EnabledRig rig(config_of(1));
  rig.tamper = [](int, Frame& frame) {  // it always says that it is enabled
    if (frame.id == 0x181) frame.data[0] = 0x37, frame.data[1] = 0x12;
    return true;
  };
  const auto asks_over_sdo = [&](size_t from) {
    return std::any_of(rig.traffic.begin() + static_cast<std::ptrdiff_t>(from), rig.traffic.end(),
                       [](const Frame& frame) { return frame.id == 0x601; });
  };
  finish(rig);
  rig.run_for(100 * kMillisecond_ns);
  rig.command.enable = true;
  rig.command.finish = false;
  rig.run_for(400 * kMillisecond_ns);
  const size_t from = rig.traffic.size();
  finish(rig);
  rig.run_for(200 * kMillisecond_ns);
  CHECK_FALSE(asks_over_sdo(from));
  rig.run_for(200 * kMillisecond_ns);
  CHECK(asks_over_sdo(from));
}

}  // namespace tendril::hal::finish_test
