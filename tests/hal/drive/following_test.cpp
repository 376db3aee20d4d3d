// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "hal/bus/little_endian.h"
#include "hal/drive/following_monitor.h"
#include "tests/hal/rig.h"

// Whether enabled axes go where they are commanded, for both protocols.

namespace tendril::hal::following_test {

using test::EnabledOdriveRig, test::EnabledRig;

constexpr int64_t kMillisecond_ns = 1'000'000;
constexpr double kTopRate = 0.03;  // m/s

MasterConfig monitored(MasterConfig config) {
  for (AxisConfig& axis : config.axes) {
    axis.top_rate = kTopRate;
    axis.displacement_min = -0.1;
    axis.displacement_max = 0.2;
  }
  return config;
}

/// Lets all axes go at the top rate for so long.
void move(auto& rig, int64_t duration_ns, double rate = kTopRate) {
  rig.follow_measured = false;
  const int64_t end_ns = rig.bus.time_ns() + duration_ns;
  while (rig.bus.time_ns() < end_ns && !rig.faulted()) {
    for (int i = 0; i < rig.command.axes; ++i)
      rig.command.displacement[i] += rate * 1e-9 * static_cast<double>(test::kPeriod_ns);
    rig.cycle();
  }
}

TEST_CASE(
    "The limit is that of the file, else the way at the top rate in 0.03 s and a hundredth of the range",
    "[unit]") {
  AxisConfig axis = monitored(test::config_of(1)).axes[0];
  CHECK(following_error_limit(axis) == Approx(0.03 * kTopRate + 0.01 * 0.3));
  axis.following_error = 2e-3;
  CHECK(following_error_limit(axis) == 2e-3);
  axis.set_point = SetPoint::kEffort;
  CHECK(std::isinf(following_error_limit(axis)));
}

TEST_CASE("Drives that follow at the top rate are far from their limit", "[law]") {
  const auto follows = [](auto&& rig, double share) {
    move(rig, 1'000 * kMillisecond_ns);
    CHECK_FALSE(rig.faulted());
    const double lag = std::abs(rig.command.displacement[0] - rig.measured.displacement[0]);
    CHECK(lag < share * following_error_limit(monitored(test::config_of(1)).axes[0]));
  };
  follows(EnabledRig(monitored(test::config_of(2))), 0.2);
  follows(EnabledOdriveRig(monitored(test::odrive_config_of(2))), 0.3);
}

TEST_CASE("An axis that stands while it is commanded to move is a fault that names both displacements",
          "[law]") {
  const auto stands = [](auto&& rig) {
    rig.drives[1].set_jammed(true);
    const double start = rig.measured.displacement[1];
    move(rig, 2'000 * kMillisecond_ns);
    const DriveFault fault = rig.measured.fault;
    CHECK(fault.kind == FaultKind::kNotFollowing);
    CHECK(fault.axis == 1);
    CHECK(fault.measured == Approx(start).margin(1e-4));
    const double limit = following_error_limit(monitored(test::config_of(1)).axes[0]);
    CHECK(fault.wanted - fault.measured == Approx(limit).margin(0.02 * kTopRate));
    rig.command.enable = false;
    rig.run_for(100 * kMillisecond_ns);
    CHECK(rig.drives[1].power_stage() != PowerStage::kOn);
    CHECK_THAT(rig.master.describe(fault),
               Catch::Contains("'cable 1'") && Catch::Contains("does not follow"));
  };
  stands(EnabledRig(monitored(test::config_of(2))));
  stands(EnabledOdriveRig(monitored(test::odrive_config_of(2))));
}

TEST_CASE("A position that no motor can have reached is implausible feedback", "[law]") {
  const double turn = test::config_of(1).axes[0].scale.displacement_per_turn;
  for (const double turns : {0.8, 12.0, -30'000.0}) {
    CAPTURE(turns);
    EnabledRig canopen(monitored(test::config_of(2)));
    canopen.tamper = [&](int axis, Frame& frame) {
      if (axis == 0 && frame.id == 0x181)
        put(frame.data, 2, static_cast<int32_t>(get<int32_t>(frame.data, 2) + 65536 * turns));
      return true;
    };
    EnabledOdriveRig odrive(monitored(test::odrive_config_of(2)));
    odrive.tamper = [&](int axis, Frame& frame) {
      if (const auto estimates = decode_odrive_estimates(frame, 0); axis == 0 && estimates)
        frame = encode_odrive_estimates(0, {static_cast<float>(estimates->position + turns), 0});
      return true;
    };
    canopen.follow_measured = odrive.follow_measured = false;
    for (const DriveFault& fault : {canopen.fault(), odrive.fault()}) {
      CHECK(fault.kind == FaultKind::kFeedbackJumped);
      CHECK(fault.axis == 0);
      CHECK(fault.measured - fault.wanted == Approx(turns * turn).epsilon(1e-3));
    }
    CHECK_THAT(canopen.master.describe(canopen.measured.fault), Catch::Contains("implausible"));
  }
}

TEST_CASE("A drive that says it does not follow is believed after a tenth of a second", "[law]") {
  // Bits that are set and cleared in its statusword, and whether that is a fault.
  const std::tuple<uint16_t, uint16_t, bool> rows[] = {{0, kFollowsCommand, true},
                                                       {kInternalLimit, kFollowsCommand, true},
                                                       {kFollowingError, 0, true},
                                                       {kInternalLimit, 0, false}};
  for (const auto& [set, cleared, is_fault] : rows) {
    CAPTURE(set, cleared);
    EnabledRig rig(monitored(test::config_of(2)));
    rig.run_for(20 * kMillisecond_ns);
    rig.tamper = [set = set, cleared = cleared](int axis, Frame& frame) {
      if (axis == 1 && frame.id == 0x182)
        put(frame.data, 0, static_cast<uint16_t>((get<uint16_t>(frame.data, 0) | set) & ~cleared));
      return true;
    };
    rig.run_for(90 * kMillisecond_ns);
    CHECK_FALSE(rig.faulted());
    rig.run_for(30 * kMillisecond_ns);
    CHECK(rig.faulted() == is_fault);
    if (!is_fault) continue;
    CHECK(rig.measured.fault.kind == FaultKind::kNotFollowing);
    CHECK_THAT(rig.master.describe(rig.measured.fault), Catch::Contains("says the drive (statusword "));
  }
}

TEST_CASE("A drive without the bit that says it follows runs, unless it is at a limit of its own", "[law]") {
  for (const bool limited : {false, true}) {
    test::Rig rig(monitored(test::config_of(1)));
    rig.tamper = [limited](int, Frame& frame) {
      if (frame.id != 0x181) return true;
      const auto word = static_cast<uint16_t>(get<uint16_t>(frame.data, 0) & ~kFollowsCommand);
      put(frame.data, 0, static_cast<uint16_t>(limited ? word | kInternalLimit : word));
      return true;
    };
    REQUIRE(rig.enable());
    rig.run_for(500 * kMillisecond_ns);
    CHECK(rig.faulted() == limited);
  }
}

}  // namespace tendril::hal::following_test
