// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <catch2/catch.hpp>

#include "hal/odrive/odrive_master.h"
#include "tests/hal/rig.h"

// What goes wrong with ODrive axes, one row of the fault table each.

namespace tendril::hal::odrive_faults_test {
using namespace tendril::hal::test;

constexpr int64_t kMillisecond_ns = 1'000'000;

TEST_CASE("When the master is gone the watchdog of every axis stops it", "[unit]") {
  const OdriveFirmware firmware = GENERATE(OdriveFirmware::k0_5, OdriveFirmware::k0_6);
  EnabledOdriveRig rig(odrive_config_of(4, firmware));
  rig.follow_measured = false;
  for (double& position : rig.command.displacement) position = 50;  // on their way for long
  rig.run_for(20 * kMillisecond_ns);
  rig.master_alive = false;
  rig.run_for(300 * kMillisecond_ns);
  double stopped[4];
  for (int i = 0; i < 4; ++i) {
    stopped[i] = rig.drives[i].position();
    CHECK(rig.drives[i].state() == kOdriveIdle);
    CHECK(rig.drives[i].axis_error() == odrive_watchdog_error(firmware));
  }
  rig.run_for(500 * kMillisecond_ns);
  for (int i = 0; i < 4; ++i) CHECK(rig.drives[i].position() == stopped[i]);
}

TEST_CASE("A new master clears the watchdogs that went off, and does not move anything", "[unit]") {
  EnabledOdriveRig rig(odrive_config_of(4));
  rig.master_alive = false;
  rig.run_for(500 * kMillisecond_ns);
  OdriveRig successor(odrive_config_of(4));
  successor.drives = rig.drives;
  successor.bus.set_time(rig.bus.time_ns());
  REQUIRE(successor.run_until([&] { return successor.measured.all_known; }));
  CHECK_FALSE(successor.faulted());
  successor.command.enable = true;
  REQUIRE(successor.run_until([&] { return successor.measured.all_enabled; }));
  CHECK(successor.find("018#") >= 0);
  for (int i = 0; i < 4; ++i) CHECK(successor.drives[i].position() == rig.drives[i].position());
}

TEST_CASE("A watchdog that goes off before the first frame is cleared, whenever it does", "[unit]") {
  const int64_t heartbeat_ns = GENERATE(1, 20, 50, 100) * kMillisecond_ns;
  CAPTURE(heartbeat_ns);
  // While the master listens nothing feeds the axes. Some have a heartbeat just before, some just after.
  for (int64_t timeout_ns = std::max(2 * heartbeat_ns, 10 * kMillisecond_ns);
       timeout_ns < 400 * kMillisecond_ns; timeout_ns += 5 * kMillisecond_ns) {
    CAPTURE(timeout_ns);
    MasterConfig config = odrive_config_of(2);
    config.heartbeat_ns = heartbeat_ns;
    config.heartbeat_timeout_ns = timeout_ns;
    config.listen_ns = 200 * kMillisecond_ns;
    OdriveRig rig(config, kMillisecond_ns / 3);
    rig.command.enable = true;
    rig.run_until([&] { return rig.measured.all_enabled || rig.faulted(); });
    INFO(rig.master.describe(rig.measured.fault));
    CHECK(rig.measured.all_enabled);
  }
}

TEST_CASE("An ODrive axis that falls silent is a fault with its name, and the others go on", "[unit]") {
  EnabledOdriveRig rig(odrive_config_of(4));
  rig.plugs[2]->set_plugged(false);
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kFeedbackLost);  // positions come more often than heartbeats
  CHECK(fault.axis == 2);
  CHECK(rig.master.describe(fault) == "axis 2 'cable 2' (node 2): position feedback lost");
  rig.follow_measured = false;
  rig.command.displacement = rig.measured.displacement;
  rig.command.displacement[0] += 5e-3;
  rig.run_for(400 * kMillisecond_ns);
  CHECK(rig.measured.displacement[0] == Approx(rig.command.displacement[0]).margin(1e-5));
  CHECK(rig.measured.fault.axis == 2);          // stays latched
  CHECK(rig.drives[2].state() == kOdriveIdle);  // by its watchdog

  rig.plugs[2]->set_plugged(true);
  rig.follow_measured = true;
  rig.run_for(500 * kMillisecond_ns);
  CHECK_FALSE(rig.measured.all_enabled);  // no return without reset
  CHECK(rig.reset());
  CHECK_FALSE(rig.faulted());
}

TEST_CASE("The power of a silent ODrive axis is unknown at the end of a run, whatever fault came first",
          "[unit]") {
  EnabledOdriveRig rig(odrive_config_of(4));
  rig.plugs[2]->set_plugged(false);
  REQUIRE(rig.fault().kind == FaultKind::kFeedbackLost);  // its heartbeats are missed later
  if (GENERATE(false, true)) {
    rig.command.reset = true;  // and it does not come back
    rig.cycle();
    rig.command.reset = false;
  }
  rig.command.enable = false;
  rig.command.finish = true;
  rig.run_for(1'000 * kMillisecond_ns);
  CHECK_FALSE(rig.measured.finished);  // the controller ends the run without it
  CHECK(rig.measured.power[2] == DrivePower::kUnknown);
  CHECK(rig.measured.power[0] == DrivePower::kOff);
}

TEST_CASE("A missing heartbeat and missing positions are each noticed where the other goes on", "[unit]") {
  const auto [id, kind] =
      GENERATE(std::pair{0x21u, FaultKind::kHeartbeatLost}, std::pair{0x29u, FaultKind::kFeedbackLost});
  EnabledOdriveRig rig(odrive_config_of(2));
  rig.tamper = [lost = id](int, Frame& frame) { return frame.id != lost; };
  CHECK(rig.fault().kind == kind);
  CHECK(rig.measured.fault.axis == 1);
  CHECK(rig.measured.all_known == (kind == FaultKind::kHeartbeatLost));
  rig.run_for(500 * kMillisecond_ns);
  CHECK(rig.drives[1].state() == kOdriveIdle);  // we ordered it, although it may not have been heard
  CHECK(rig.drives[0].state() == kOdriveClosedLoop);
}

TEST_CASE("A position that is not a number is none", "[unit]") {
  EnabledOdriveRig rig(odrive_config_of(2));
  rig.tamper = [](int axis, Frame& frame) {
    if (axis == 1 && decode_odrive_estimates(frame, 1)) frame = *parse_frame("029#0000C07F00000000");
    return true;
  };
  CHECK(rig.fault().kind == FaultKind::kFeedbackLost);
}

TEST_CASE("An axis error is latched with its bits in words and cleared by reset", "[unit]") {
  const auto [firmware, words] = GENERATE(
      std::pair{OdriveFirmware::k0_5,
                "axis 1 'cable 1' (node 1): drive fault: over-temperature (axis error 00040000)"},
      std::pair{OdriveFirmware::k0_6,
                "axis 1 'cable 1' (node 1): drive fault: inverter over-temperature (axis error 00004000)"});
  EnabledOdriveRig rig(odrive_config_of(4, firmware));
  rig.drives[1].overheat();
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kDriveFault);
  CHECK(fault.axis == 1);
  CHECK(rig.master.describe(fault) == words);
  rig.run_for(1'000 * kMillisecond_ns);
  CHECK(rig.drives[1].axis_error() != 0);  // not cleared behind the operator's back
  CHECK(rig.drives[0].state() == kOdriveClosedLoop);
  CHECK(rig.reset());
  CHECK(rig.drives[1].axis_error() == 0);
}

TEST_CASE("An axis that leaves closed-loop control with error 0 is a fault", "[unit]") {
  const auto [firmware, words] =
      GENERATE(std::pair{OdriveFirmware::k0_5, "it is in 'idle', its motor has an error"},
               std::pair{OdriveFirmware::k0_6, "it is in 'idle', result 'disarmed'"});
  EnabledOdriveRig rig(odrive_config_of(2, firmware));
  rig.drives[0].unplug_motor();
  const DriveFault fault = rig.fault(200 * kMillisecond_ns);
  CHECK(fault.kind == FaultKind::kDriveDisabled);
  CHECK(fault.axis == 0);
  CHECK(rig.master.describe(fault) ==
        std::string("axis 0 'cable 0' (node 0): drive left operation unasked, ") + words);
  CHECK(rig.reset());
}

TEST_CASE("An absent axis is a time-out at the start, and robots are enabled whole or not at all", "[unit]") {
  OdriveRig rig(odrive_config_of(3));
  rig.plugs[1]->set_plugged(false);
  rig.command.enable = true;
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kStartTimeout);
  CHECK(rig.master.describe(fault) ==
        "axis 1 'cable 1' (node 1): drive did not start, no heartbeat was heard");
  rig.run_for(500 * kMillisecond_ns);
  CHECK(rig.drives[0].state() == kOdriveIdle);
  rig.plugs[1]->set_plugged(true);
  CHECK(rig.reset());
}

TEST_CASE("An axis that tells no positions is a time-out that says so", "[unit]") {
  OdriveRig rig(odrive_config_of(2));
  rig.tamper = [](int axis, Frame& frame) { return !(axis == 1 && decode_odrive_estimates(frame, 1)); };
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kStartTimeout);
  CHECK_THAT(rig.master.describe(fault), Catch::Contains("no position (encoder estimates)"));
}

TEST_CASE("An axis without a reference refuses, never moves, and the reason is told", "[unit]") {
  const auto [firmware, words] = GENERATE(
      std::pair{OdriveFirmware::k0_5, "drive fault: invalid state (axis error 00000001)"},
      std::pair{OdriveFirmware::k0_6, "drive did not enable, it is in 'idle', result 'not calibrated'"});
  OdriveRig rig(odrive_config_of(2, firmware));
  rig.drives[1] =
      SimulatedOdriveDrive({.node = 1, .firmware = firmware, .position = 0.5, .calibrated = false});
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.command.enable = true;
  rig.follow_measured = false;
  rig.command.displacement.fill(1);
  const DriveFault fault = rig.fault();
  CHECK(rig.master.describe(fault) == std::string("axis 1 'cable 1' (node 1): ") + words);
  rig.run_for(500 * kMillisecond_ns);
  CHECK(rig.drives[0].position() == Approx(0.25));
  CHECK(rig.drives[1].position() == 0.5);
}

TEST_CASE("A position that was told wrong until closed-loop control is a fault and no motion", "[unit]") {
  OdriveRig rig(odrive_config_of(2, OdriveFirmware::k0_5));
  rig.drives[1] = SimulatedOdriveDrive(
      {.node = 1, .firmware = OdriveFirmware::k0_5, .position = 0.5, .late_estimator = true});
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  const int from = static_cast<int>(rig.traffic.size());
  rig.command.enable = true;
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kPositionJumped);
  CHECK(rig.master.describe(fault) ==
        "axis 1 'cable 1' (node 1): position jumped at enabling by 0.500 turns: has it a reference?");
  const int closed = rig.find("027#08000000", from);
  REQUIRE(closed >= 0);
  rig.run_for(200 * kMillisecond_ns);
  CHECK(rig.drives[1].state() == kOdriveIdle);
  CHECK(rig.drives[1].position() == 0.5);
  for (int k = closed; k < static_cast<int>(rig.traffic.size()); ++k)
    CHECK_FALSE(decode_odrive_input(rig.traffic[k], 1));
}

TEST_CASE("Errors that do not clear are reported with their bits in the end", "[unit]") {
  OdriveRig rig(odrive_config_of(2));
  rig.tamper = [](int axis, Frame& frame) {
    if (axis == 0 && decode_odrive_heartbeat(frame, 0, OdriveFirmware::k0_6)) frame.data[1] = 0x02;
    return true;
  };
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  CHECK_FALSE(rig.faulted());
  const int from = static_cast<int>(rig.traffic.size());
  rig.command.enable = true;
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kDriveFault);
  CHECK_THAT(rig.master.describe(fault), Catch::Contains("DC bus under-voltage"));
  int clears = 0;
  for (int at = rig.find("018#", from); at >= 0; at = rig.find("018#", at + 1)) ++clears;
  CHECK(clears > 10);  // once a heartbeat, for three seconds
  CHECK(clears < 40);
  CHECK(rig.find("007#08000000", from) < 0);
}

TEST_CASE("An order that was lost is given again", "[unit]") {
  OdriveRig rig(odrive_config_of(1));
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.plugs[0]->set_plugged(false);
  rig.command.enable = true;
  rig.cycle();
  rig.cycle();
  rig.plugs[0]->set_plugged(true);
  CHECK(rig.run_until([&] { return rig.measured.all_enabled; }));
  CHECK_FALSE(rig.faulted());
}

TEST_CASE("A request of closed-loop control that was lost is repeated with all that belongs before it",
          "[law]") {
  MasterConfig config = odrive_config_of(1);
  odrive_settings(config.axes[0]).velocity_limit = 20;
  odrive_settings(config.axes[0]).current_limit = 10;
  OdriveRig rig(config);
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.plugs[0]->set_plugged(false);
  rig.command.enable = true;
  rig.cycle();
  rig.cycle();
  rig.plugs[0]->set_plugged(true);
  const size_t from = rig.traffic.size();
  REQUIRE(rig.run_until([&] { return rig.measured.all_enabled; }));
  const int request = rig.find("007#08000000", static_cast<int>(from));
  REQUIRE(request >= 3);
  CHECK(rig.traffic[request - 3].id == odrive_id(0, OdriveMessage::kSetControllerMode));
  CHECK(rig.traffic[request - 2].id == odrive_id(0, OdriveMessage::kSetLimits));
  CHECK(rig.traffic[request - 1].id == odrive_id(0, OdriveMessage::kSetInputPosition));
}

TEST_CASE("No cycle of an ODrive master has more frames than may wait for the bus", "[law]") {
  const int axes = GENERATE(1, 2, 4, 9, 32);
  CAPTURE(axes);
  MasterConfig config = odrive_config_of(axes);
  for (AxisConfig& axis : config.axes) {
    odrive_settings(axis).velocity_limit = 20;
    odrive_settings(axis).current_limit = 10;
  }
  OdriveRig rig(config);
  int most = 0;
  const auto count = [&] {
    most = std::max(most, rig.batch.size());
    return false;
  };
  rig.run_until(count, 300 * kMillisecond_ns);
  rig.command.enable = true;
  rig.run_until(count, 2'000 * kMillisecond_ns);
  CHECK(rig.measured.all_enabled);
  rig.command.enable = false;
  rig.command.finish = true;
  rig.run_until(count, 300 * kMillisecond_ns);
  CHECK(rig.measured.finished);
  CHECK(most > axes);
  CHECK(most <= kWaitingCycles * frames_in_cycle(axes));
}

TEST_CASE("The state of the bus becomes a fault of the whole robot with ODrive axes too", "[unit]") {
  EnabledOdriveRig rig(odrive_config_of(2));
  rig.controller.set_health(BusHealth::kOff);
  rig.cycle();
  CHECK(rig.measured.fault.kind == FaultKind::kBusOff);
  CHECK(rig.measured.fault.axis == -1);
  CHECK(rig.master.describe(rig.measured.fault) == "bus-off");
  rig.run_for(1'000 * kMillisecond_ns);
  CHECK(rig.measured.fault.kind == FaultKind::kBusOff);  // the cause, not what followed from it
  rig.controller.set_health(BusHealth::kActive);
  CHECK(rig.reset());
}

}  // namespace tendril::hal::odrive_faults_test
