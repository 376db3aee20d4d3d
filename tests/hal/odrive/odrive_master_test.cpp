// SPDX-License-Identifier: Apache-2.0
#include "hal/odrive/odrive_master.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/hal/rig.h"

namespace tendril::hal::odrive_master_test {
using namespace tendril::hal::test;

constexpr int64_t kMillisecond_ns = 1'000'000;

double start_of(int axis) { return (axis % 2 == 1 ? -1 : 1) * 0.25 * (axis + 1) * 0.0628; }

TEST_CASE("Positions of ODrive axes are known before anything is enabled", "[unit]") {
  const OdriveFirmware firmware = GENERATE(OdriveFirmware::k0_5, OdriveFirmware::k0_6);
  OdriveRig rig(odrive_config_of(4, firmware));
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  CHECK(rig.measured.all_disabled);
  CHECK_FALSE(rig.measured.all_enabled);
  for (int i = 0; i < 4; ++i) CHECK(rig.measured.displacement[i] == Approx(start_of(i)));
  rig.run_for(1'000 * kMillisecond_ns);
  CHECK_FALSE(rig.faulted());
  for (const SimulatedOdriveDrive& drive : rig.drives) CHECK(drive.state() == kOdriveIdle);
}

TEST_CASE("Enabling node 2 takes the frames of CANSimple in their order", "[unit]") {
  MasterConfig config = odrive_config_of(3);
  odrive_settings(config.axes[2]) = {
      .velocity_limit = 20, .current_limit = 10, .counts_from_power_on = false};
  OdriveRig rig(config);
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.run_for(300 * kMillisecond_ns);  // fed: no watchdog goes off
  const auto from = static_cast<int>(rig.traffic.size());
  rig.command.enable = true;
  REQUIRE(rig.run_until([&] { return rig.measured.all_enabled; }));
  const char* expected[] = {"04B#0300000001000000",   // position control, passthrough
                            "04F#0000A04100002041",   // 20 rev/s, 10 A
                            "04C#0000403F00000000",   // 0.75 rev, where it stands
                            "047#08000000",           // closed-loop control
                            "041#0000000008000000"};  // and it is there
  int at = from;
  for (const char* text : expected) {
    CAPTURE(text);
    at = rig.find(text, at);
    REQUIRE(at >= 0);
  }
  CHECK(rig.find("058#", from) < 0);  // no error was there to clear
  for (int k = from; k < static_cast<int>(rig.traffic.size()); ++k)
    CHECK_FALSE(decode_odrive_limits(rig.traffic[k], 0));  // none are given
}

TEST_CASE("Enabling ODrive axes is no jump, whatever is commanded before all are enabled", "[unit]") {
  const int64_t delay_ns = GENERATE(0, 2 * kPeriod_ns + 1);
  OdriveRig rig(odrive_config_of(4), delay_ns);
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.follow_measured = false;
  rig.command.displacement.fill(0.5);  // far away
  rig.command.enable = true;
  int slow = 3;  // heartbeats in which the last axis is still idle
  rig.tamper = [&slow](int axis, Frame& frame) {
    if (axis == 3 && frame.id == 0x61 && frame.data[4] == kOdriveClosedLoop && --slow > 0)
      frame.data[4] = kOdriveIdle;
    return true;
  };
  for (int cycles = 0; cycles < 2000; ++cycles) {
    rig.cycle();
    if (rig.measured.all_enabled) break;  // from this cycle on commands are followed
    for (int i = 0; i < 4; ++i) CHECK(rig.drives[i].position() == Approx(0.25 * (i + 1)));
  }
  REQUIRE(rig.measured.all_enabled);
  CHECK(slow <= 0);
}

TEST_CASE("A state that no heartbeat confirms is requested again twice a second, not every cycle", "[unit]") {
  OdriveRig rig(odrive_config_of(1));
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.tamper = [](int, Frame& frame) {
    if (frame.id == odrive_id(0, OdriveMessage::kHeartbeat)) frame.data[4] = kOdriveIdle;
    return true;
  };
  const auto from = rig.traffic.size();
  rig.command.enable = true;
  rig.run_for(2'000 * kMillisecond_ns);
  int requests = 0;
  for (size_t i = from; i < rig.traffic.size(); ++i)
    requests += decode_odrive_state(rig.traffic[i], 0) == kOdriveClosedLoop;
  CHECK(requests >= 4);
  CHECK(requests <= 5);
}

TEST_CASE("Enabled ODrive axes follow the commanded lengths, each in its own sense", "[unit]") {
  const OdriveFirmware firmware = GENERATE(OdriveFirmware::k0_5, OdriveFirmware::k0_6);
  EnabledOdriveRig rig(odrive_config_of(4, firmware));
  rig.follow_measured = false;
  for (int step = 0; step <= 600; ++step) {
    for (int i = 0; i < 4; ++i) rig.command.displacement[i] = start_of(i) + 20e-3 * step / 600;
    rig.cycle();
    // 20 mm/s, of which an axis that was not told the velocity would lag 50 ms behind.
    if (step > 300)
      for (int i = 0; i < 4; ++i)
        CHECK(rig.drives[i].position() * (i % 2 == 1 ? -0.0628 : 0.0628) ==
              Approx(rig.command.displacement[i]).margin(1e-4));
  }
  rig.run_for(500 * kMillisecond_ns);
  for (int i = 0; i < 4; ++i) CHECK(rig.measured.displacement[i] == Approx(start_of(i) + 20e-3).margin(1e-6));
  CHECK_FALSE(rig.faulted());
  rig.command.displacement.fill(std::nan(""));
  rig.run_for(100 * kMillisecond_ns);
  CHECK(rig.measured.displacement[0] == Approx(start_of(0) + 20e-3).margin(1e-6));  // holds
}

TEST_CASE("Each axis gets one frame a cycle once it is enabled", "[unit]") {
  EnabledOdriveRig rig(odrive_config_of(4));
  for (int cycle = 0; cycle < 20; ++cycle) {
    rig.cycle();
    REQUIRE(rig.batch.size() == 4);
    for (int i = 0; i < 4; ++i) CHECK(rig.batch[i].id == odrive_id(i, OdriveMessage::kSetInputPosition));
  }
}

TEST_CASE("Thirty-two ODrive axes are enabled without a batch that overflows", "[unit]") {
  MasterConfig config = odrive_config_of(32);
  for (AxisConfig& axis : config.axes)
    odrive_settings(axis) = {.velocity_limit = 20, .current_limit = 10, .counts_from_power_on = false};
  EnabledOdriveRig rig(config);
  CHECK(rig.batch.dropped() == 0);
}

TEST_CASE("ODrive axes are disabled by the idle state, and after the farewell hear nothing", "[unit]") {
  EnabledOdriveRig rig(odrive_config_of(2));
  const auto from = static_cast<int>(rig.traffic.size());
  rig.command.enable = false;
  REQUIRE(rig.run_until([&] { return rig.measured.all_disabled; }));
  CHECK(rig.find("007#01000000", from) >= 0);
  CHECK(rig.find("027#01000000", from) >= 0);
  for (const SimulatedOdriveDrive& drive : rig.drives) CHECK(drive.state() == kOdriveIdle);
  rig.command.finish = true;
  REQUIRE(rig.run_until([&] { return rig.measured.finished; }));
  rig.run_for(20 * kMillisecond_ns);
  CHECK(rig.batch.size() == 0);
}

TEST_CASE("ODrive axes can be disabled and enabled again at any moment", "[unit]") {
  const int64_t delay_ns = GENERATE(0, 2 * kPeriod_ns + 1);
  CAPTURE(delay_ns);
  EnabledOdriveRig rig(odrive_config_of(3), delay_ns);
  for (int cycles = 1; cycles < 150; cycles = 2 * cycles + 1) {
    CAPTURE(cycles);
    rig.command.enable = false;
    for (int i = 0; i < cycles; ++i) rig.cycle();
    rig.command.enable = true;
    for (int i = 0; i < cycles; ++i) rig.cycle();  // and away again before it is enabled
    rig.command.enable = false;
    rig.cycle();
    rig.command.enable = true;
    REQUIRE(rig.run_until([&] { return rig.measured.all_enabled; }, 1'000 * kMillisecond_ns));
    REQUIRE_FALSE(rig.faulted());
  }
}

TEST_CASE("An axis that an earlier life left in closed-loop control is taken out of it first", "[unit]") {
  OdriveRig rig(odrive_config_of(2));
  FrameBatch ignored;
  rig.drives[1].receive(encode_odrive_mode(1, {}), 0, ignored);
  rig.drives[1].receive(encode_odrive_state(1, kOdriveClosedLoop), 0, ignored);
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.run_for(200 * kMillisecond_ns);
  CHECK(rig.measured.all_disabled);
  CHECK(rig.drives[1].state() == kOdriveIdle);
  CHECK(rig.enable());
  CHECK(rig.drives[1].position() == Approx(0.5));
}

TEST_CASE("Frames of strangers change nothing for ODrive axes", "[unit]") {
  EnabledOdriveRig rig(odrive_config_of(2));
  VirtualEndpoint& stranger = rig.bus.attach("stranger");
  for (const char* text :
       {"041#0100000001000000", "00000001#0100000001000000", "001#01", "7FF#0102030405060708",
        "009#0000C07F00000000"})  // the last: a position that is not a number
    stranger.send(*parse_frame(text));
  rig.run_for(20 * kMillisecond_ns);
  CHECK_FALSE(rig.faulted());
  CHECK(rig.measured.all_enabled);
  CHECK(std::isfinite(rig.measured.displacement[0]));
}

TEST_CASE("Sensors are heard beside ODrive axes", "[unit]") {
  MasterConfig config = odrive_config_of(1);
  config.sensors = {camera(0x7F0)};
  OdriveRig rig(config);
  rig.run_for(200 * kMillisecond_ns);
  CHECK_FALSE(rig.measured.sensors.fresh[0]);
  const double seen[] = {0.01, 0.02, 0.125};
  rig.bus.attach("camera").send(*encode_sample(config.sensors[0], seen, 5 * kMillisecond_ns));
  const int64_t now_ns = rig.bus.time_ns();
  rig.cycle();
  CHECK(rig.measured.sensors.fresh[0]);
  CHECK(rig.measured.sensors.stamp_ns[0] == now_ns - 5 * kMillisecond_ns);
  CHECK(rig.measured.sensors.value[2] == Approx(0.125));
}

TEST_CASE("An ODrive axis is sent finite numbers, however far it is commanded", "[unit]") {
  const bool on_effort = GENERATE(false, true);
  const MasterConfig config = odrive_config_of(2);
  EnabledOdriveRig rig(on_effort ? on_efforts(config, 2, 10) : config);
  rig.follow_measured = false;
  rig.command.displacement.fill(GENERATE(1e300, -1e300));
  rig.command.effort = rig.command.displacement;
  rig.cycle();
  int set_points = 0;
  for (const Frame& frame : rig.batch)
    for (const int node : {0, 1}) {
      const auto input = decode_odrive_input(frame, node);
      const auto torque = decode_odrive_torque(frame, node);
      if (input) CHECK(std::isfinite(input->position));
      if (torque) CHECK(std::isfinite(*torque));
      set_points += input || torque;
    }
  CHECK(set_points == 2);
}

}  // namespace tendril::hal::odrive_master_test
