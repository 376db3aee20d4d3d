// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/hal/rig.h"

// Axes that follow efforts, of either protocol: torques instead of positions, from the instant at which they
// are enabled, and a range that they may not leave.

namespace tendril::hal::effort_test {
using namespace tendril::hal::test;

constexpr int64_t kMillisecond_ns = 1'000'000;
constexpr double kSpring = 2000;    // N/m
constexpr double kSlack = -3e-3;    // m: displacement at which a spring pulls with nothing
constexpr double kHeld = 5e-3;      // of an effort
constexpr double kForce_N = 200;    // greatest force of either rig's drives, as their specs have it
constexpr double kRange_m = 10e-3;  // either way

template <class AnyRig>
MasterConfig config_of_rig(int axes);
template <>
MasterConfig config_of_rig<Rig>(int axes) {
  return config_of(axes);
}
template <>
MasterConfig config_of_rig<OdriveRig>(int axes) {
  MasterConfig config = odrive_config_of(axes);
  odrive_settings(config).encoder_period_ns = 2 * kMillisecond_ns;
  return config;
}

/// Two axes that follow efforts, the second of them reversed, and one that follows displacements.
template <class AnyRig>
MasterConfig mixed() {
  return on_efforts(config_of_rig<AnyRig>(3), 2, kRange_m);
}

/// Winches that wind up springs, all of them slack at the same displacement.
template <class AnyRig>
struct Winches : AnyRig {
  explicit Winches(const MasterConfig& config) : AnyRig(config), axes(config.axes) {
    if constexpr (std::is_same_v<AnyRig, OdriveRig>)
      for (size_t i = 0; i < axes.size(); ++i)
        this->drives[i] =
            SimulatedOdriveDrive({.node = axes[i].node,
                                  .top_speed = 15,
                                  .position = 0.05 * static_cast<double>(i),
                                  .tuning = {.friction = 0.2},
                                  .torque_limit = std::abs(axes[i].scale.to_torque(kForce_N)),
                                  .encoder_period_ns = odrive_settings(config).encoder_period_ns,
                                  .watchdog_ns = config.heartbeat_timeout_ns});
  }

  double displacement(int i) const { return axes[i].scale.to_displacement(this->drives[i].position()); }
  double tension(int i) const { return broken ? 0 : kSpring * std::max(0.0, displacement(i) - kSlack); }

  /// Lets time pass while the springs pull. @return whether it was done
  template <class Done>
  bool pull_until(const Done& done, int64_t limit_ns = 5'000 * kMillisecond_ns) {
    return this->run_until(
        [&] {
          for (int i = 0; i < static_cast<int>(axes.size()); ++i)
            this->drives[i].set_load((axes[i].scale.reversed ? -1 : 1) * tension(i) / kForce_N);
          return done();
        },
        limit_ns);
  }
  void pull_for(int64_t duration_ns) {
    pull_until([] { return false; }, duration_ns);
  }
  bool enable_pulled() {
    if (!pull_until([this] { return this->measured.all_known || this->faulted(); })) return false;
    this->command.enable = true;
    return pull_until([this] { return this->measured.all_enabled || this->faulted(); }) && !this->faulted();
  }

  std::vector<AxisConfig> axes;
  bool broken = false;
};

TEST_CASE("A torque does the work of its effort, whichever way the drive turns", "[law]") {
  for (const bool reversed : {false, true}) {
    const AxisScale scale{.counts_per_turn = 4096, .displacement_per_turn = 2e-3, .reversed = reversed};
    const double turns = scale.to_position(0.5e-3) / scale.counts_per_turn;
    CHECK(scale.to_torque(30) * 2 * M_PI * turns == Approx(30 * 0.5e-3));
  }
}

TEMPLATE_TEST_CASE("An axis that follows an effort comes to rest where its load equals it", "[unit]", Rig,
                   OdriveRig) {
  Winches<TestType> rig(mixed<TestType>());
  rig.command.effort = {8, 4, 99};
  REQUIRE(rig.enable_pulled());
  rig.pull_for(1'000 * kMillisecond_ns);
  CHECK_FALSE(rig.faulted());
  CHECK(rig.tension(0) == Approx(8).epsilon(kHeld));
  CHECK(rig.tension(1) == Approx(4).epsilon(kHeld));
  rig.follow_measured = false;
  rig.command.effort = {20, 2, NAN};
  rig.command.displacement[2] = rig.displacement(2) + 1e-3;
  const double goal = rig.command.displacement[2];
  rig.pull_for(1'000 * kMillisecond_ns);
  CHECK(rig.tension(0) == Approx(20).epsilon(kHeld));
  CHECK(rig.tension(1) == Approx(2).epsilon(kHeld));
  CHECK(rig.displacement(2) == Approx(goal).margin(2e-6));  // and its neighbour follows positions
}

TEMPLATE_TEST_CASE("An effort that is no number leaves an axis with the last one", "[unit]", Rig, OdriveRig) {
  Winches<TestType> rig(mixed<TestType>());
  rig.command.effort = {8, 8, 0};
  REQUIRE(rig.enable_pulled());
  rig.pull_for(1'000 * kMillisecond_ns);
  rig.command.effort = {NAN, INFINITY, 0};
  rig.pull_for(500 * kMillisecond_ns);
  CHECK_FALSE(rig.faulted());
  for (int i = 0; i < 2; ++i) CHECK(rig.tension(i) == Approx(8).epsilon(kHeld));
}

TEMPLATE_TEST_CASE("An axis that holds its load with the effort commanded stays where it is at enabling",
                   "[unit]", Rig, OdriveRig) {
  Winches<TestType> rig(mixed<TestType>());
  const std::array<double, 3> start = {rig.displacement(0), rig.displacement(1), rig.displacement(2)};
  for (int i = 0; i < 3; ++i) rig.command.effort[i] = rig.tension(i);
  const auto unmoved = [&] {
    for (int i = 0; i < 3; ++i)
      if (std::abs(rig.displacement(i) - start[i]) > 20e-6) return false;
    return true;
  };
  REQUIRE(rig.pull_until([&] { return rig.measured.all_known; }));
  rig.command.enable = true;
  bool stayed = true;
  REQUIRE(rig.pull_until([&] {
    stayed = stayed && unmoved();
    return rig.measured.all_enabled;
  }));
  rig.pull_for(300 * kMillisecond_ns);
  CHECK(stayed);
  CHECK(unmoved());
}

TEMPLATE_TEST_CASE("An axis whose cable breaks leaves its range, is disabled at once, and the others go on",
                   "[unit]", Rig, OdriveRig) {
  MasterConfig config = mixed<TestType>();
  config.axes[1].set_point = SetPoint::kDisplacement;
  Winches<TestType> rig(config);
  rig.command.effort = {8, 8, 8};
  REQUIRE(rig.enable_pulled());
  rig.pull_for(500 * kMillisecond_ns);
  rig.broken = true;
  REQUIRE(rig.pull_until([&] { return rig.faulted(); }, 1'000 * kMillisecond_ns));
  CHECK(rig.measured.fault.kind == FaultKind::kOutOfRange);
  CHECK(rig.measured.fault.axis == 0);
  CHECK_THAT(rig.master.describe(rig.measured.fault),
             Catch::Contains("axis 0 'cable 0'") && Catch::Contains("left its range of displacements") &&
                 Catch::Contains("% of it beyond the greatest"));
  // 2 % of the range, and the way of the 15 turns a second at most until somebody has noticed.
  CHECK(rig.displacement(0) < kRange_m + 0.02 * 2 * kRange_m + 15 * 0.0628 * 6e-3);
  rig.pull_for(5 * kMillisecond_ns);
  CHECK(rig.drives[0].power_stage() != PowerStage::kOn);
  const double stopped = rig.displacement(0);
  rig.pull_for(200 * kMillisecond_ns);
  CHECK(rig.displacement(0) == stopped);
  for (int i = 1; i < 3; ++i) CHECK(rig.drives[i].power_stage() == PowerStage::kOn);
}

TEMPLATE_TEST_CASE("An axis that is found outside its range may stay there and come back, and go no farther",
                   "[unit]", Rig, OdriveRig) {
  const bool comes_back = GENERATE(true, false);
  MasterConfig config = on_efforts(config_of_rig<TestType>(2), 1, 0.8e-3);
  config.axes[1].scale.reversed = false;
  config.axes[0].scale.offset = 2e-3;  // it stands at 2 or 3 mm then
  Winches<TestType> rig(config);
  rig.command.effort[0] = rig.tension(0);
  REQUIRE(rig.displacement(0) > 1.9e-3);
  REQUIRE(rig.enable_pulled());
  rig.pull_for(300 * kMillisecond_ns);
  REQUIRE_FALSE(rig.faulted());
  rig.command.effort[0] = comes_back ? 9 : 20;
  rig.pull_for(300 * kMillisecond_ns);
  CHECK(rig.faulted() == !comes_back);
  if (!comes_back) CHECK(rig.measured.fault.kind == FaultKind::kOutOfRange);
}

TEMPLATE_TEST_CASE("An axis of torques that loses its master stops by itself", "[unit]", Rig, OdriveRig) {
  Winches<TestType> rig(mixed<TestType>());
  rig.command.effort = {8, 8, 8};
  REQUIRE(rig.enable_pulled());
  rig.pull_for(300 * kMillisecond_ns);
  rig.master_alive = false;
  rig.pull_for(300 * kMillisecond_ns);
  for (int i = 0; i < 3; ++i) CHECK(rig.drives[i].power_stage() == PowerStage::kFault);
}

TEST_CASE("A CiA 402 axis that follows efforts is set up for torques, and its neighbour for positions",
          "[unit]") {
  Winches<Rig> rig(mixed<Rig>());
  rig.command.effort = {8, 8, 8};
  REQUIRE(rig.enable_pulled());
  CHECK(rig.find("601#2300160210007160") >= 0);  // 6071
  CHECK(rig.find("601#2F6060000A000000") >= 0);  // cyclic synchronous torque
  CHECK(rig.find("581#4F6160000A000000") >= 0);  // and it says so
  CHECK(rig.find("601#2F60600008000000") < 0);
  CHECK(rig.find("603#2300160220007A60") >= 0);
  CHECK(rig.find("603#2F60600008000000") >= 0);
  CHECK(rig.find("601#2FC26001A7000000") >= 0);  // 60C2 all the same
  // 8 N on 10 mm are 80 thousandths of 1 Nm; the second axis is reversed. Before 0F it is there already.
  const int on = rig.find("201#0F005000"), before = rig.find("201#07005000");
  CHECK(before >= 0);
  CHECK(before < on);
  CHECK(rig.find("202#0F00B0FF") >= 0);
  rig.command.enable = false;
  REQUIRE(rig.pull_until([&] { return rig.measured.all_disabled; }));
  const auto from = static_cast<int>(rig.traffic.size());
  rig.pull_for(10 * kMillisecond_ns);
  CHECK(rig.find("201#00000000", from) >= 0);
}

TEST_CASE("Torques beyond what 6071 holds are its greatest", "[unit]") {
  Winches<Rig> rig(mixed<Rig>());
  rig.command.effort = {1e6, 1e6, 0};
  REQUIRE(rig.pull_until([&] { return rig.measured.all_known; }));
  rig.command.enable = true;
  rig.pull_for(200 * kMillisecond_ns);
  CHECK(rig.find("201#0F00FF7F") >= 0);
  CHECK(rig.find("202#0F000180") >= 0);
}

TEST_CASE("Soft limits of a drive that is commanded torques leave the first word to the master", "[unit]") {
  const AxisConfig axis = mixed<Rig>().axes[0];
  const double per_count = axis.scale.displacement_per_count();
  REQUIRE(soft_limits(axis));
  CHECK(soft_limits(axis)->min == std::lround((-kRange_m - 0.4e-3) / per_count));
  CHECK(soft_limits(axis)->max == std::lround((kRange_m + 0.4e-3) / per_count));
}

TEST_CASE("A mapping as found must hold the torque where the axis follows efforts", "[unit]") {
  MasterConfig config = mixed<Rig>();
  for (AxisConfig& axis : config.axes) cia402_settings(axis).mapping = Mapping::kAsFound;
  {
    Winches<Rig> rig(config);
    rig.command.effort = {8, 8, 8};
    REQUIRE(rig.enable_pulled());
    CHECK(rig.find("201#0F005000") >= 0);
  }
  Winches<Rig> rig(config);
  rig.drives[1] = SimulatedCia402Drive({.node = 2, .rpdo_id = 0x202, .tpdo_id = 0x182});
  CHECK(rig.master.describe(rig.fault()) ==
        "axis 1 'cable 1' (node 2): drive is set up otherwise: object 1600:2 (the second object in RPDO 1) "
        "reads 0x607A0020 and must read 0x60710010");
}

TEST_CASE("An axis that is homed follows efforts only after that", "[unit]") {
  MasterConfig config = on_efforts(config_of(1), 1, kRange_m);
  cia402_settings(config.axes[0]).reference = Reference::kHoming;
  cia402_settings(config.axes[0]).homing.method = 17;
  Rig rig(config);
  rig.command.effort[0] = 8;
  REQUIRE(rig.run_until([&] { return rig.measured.all_known || rig.faulted(); }));
  REQUIRE_FALSE(rig.faulted());
  for (const Frame& frame : rig.traffic)
    if (const auto rpdo = decode_torque_command(0x201, frame)) CHECK(rpdo->torque == 0);
  const auto from = static_cast<int>(rig.traffic.size());
  rig.command.enable = true;
  REQUIRE(rig.run_until([&] { return rig.measured.all_enabled; }));
  CHECK(rig.find("601#2F6060000A000000", from) >= 0);
}

TEST_CASE("An ODrive axis that follows efforts gets torques in torque control, and no positions", "[unit]") {
  Winches<OdriveRig> rig(mixed<OdriveRig>());
  rig.command.effort = {8, 8, 8};
  REQUIRE(rig.enable_pulled());
  rig.pull_for(20 * kMillisecond_ns);
  const int mode = rig.find(to_text(encode_odrive_mode(0, {kOdriveTorqueControl, kOdrivePassthrough})));
  const int torque = rig.find(to_text(encode_odrive_torque(0, static_cast<float>(8 * 0.0628 / (2 * M_PI)))));
  const int closed = rig.find(to_text(encode_odrive_state(0, kOdriveClosedLoop)));
  REQUIRE(mode >= 0);
  CHECK(mode < torque);
  CHECK(torque < closed);
  for (const Frame& frame : rig.traffic) {
    CHECK_FALSE(decode_odrive_input(frame, 0));
    CHECK_FALSE(decode_odrive_torque(frame, 2));
  }
  rig.command.enable = false;
  REQUIRE(rig.pull_until([&] { return rig.measured.all_disabled; }));
  const auto from = static_cast<int>(rig.traffic.size());
  rig.pull_for(10 * kMillisecond_ns);
  CHECK(rig.find(to_text(encode_odrive_torque(0, 0)), from) >= 0);  // which feeds its watchdog
}

}  // namespace tendril::hal::effort_test
