// SPDX-License-Identifier: Apache-2.0

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <optional>

#include "hal/cia402/cia402_master.h"
#include "tests/hal/rig.h"

namespace tendril::hal::cia402_faults_test {
using namespace tendril::hal::test;

constexpr int64_t kMillisecond_ns = 1'000'000;

/// Makes axis 1, node 2, refuse an object, whatever it answers or only answers of one kind. For
/// RigOf::tamper.
std::function<bool(int, Frame&)> refusing(ObjectAddress object, SdoAbort reason,
                                          std::optional<SdoAnswer::Kind> kind = {}) {
  return [=](int axis, Frame& frame) {
    const auto answer = decode_sdo_answer(frame, 2);
    if (axis == 1 && answer && answer->object == object && (!kind || answer->kind == *kind))
      frame = encode_sdo_answer(2, {SdoAnswer::Kind::kAbort, object, 0, code(reason)});
    return true;
  };
}

TEST_CASE("When the master is gone every drive stops by itself and says so", "[unit]") {
  EnabledRig rig(config_of(4));
  rig.follow_measured = false;
  rig.command.displacement.fill(1.0);  // on their way for long
  rig.run_for(20 * kMillisecond_ns);
  rig.master_alive = false;
  rig.run_for(200 * kMillisecond_ns);
  double stopped[4];
  for (int i = 0; i < 4; ++i) {
    stopped[i] = rig.drives[i].position();
    CHECK(rig.drives[i].state() == DriveState::kFault);
    CHECK(rig.find("08" + std::to_string(i + 1) + "#3081110000000000") >= 0);
  }
  rig.run_for(500 * kMillisecond_ns);
  for (int i = 0; i < 4; ++i) CHECK(rig.drives[i].position() == stopped[i]);
}

TEST_CASE("A new master clears what the death of the former one left, and does not move anything", "[unit]") {
  EnabledRig rig(config_of(4));
  rig.master_alive = false;
  rig.run_for(300 * kMillisecond_ns);
  Rig successor(config_of(4));
  successor.drives = rig.drives;
  successor.bus.set_time(rig.bus.time_ns());
  REQUIRE(successor.run_until([&] { return successor.measured.all_known; }));
  CHECK_FALSE(successor.faulted());
  successor.command.enable = true;
  REQUIRE(successor.run_until([&] { return successor.measured.all_enabled; }));
  for (int i = 0; i < 4; ++i) CHECK(successor.drives[i].position() == rig.drives[i].position());
}

TEST_CASE("A drive that falls silent is a fault with its axis, and the others go on", "[unit]") {
  EnabledRig rig(config_of(4));
  rig.plugs[2]->set_plugged(false);
  const DriveFault fault = rig.fault();
  CHECK((fault.kind == FaultKind::kFeedbackLost || fault.kind == FaultKind::kHeartbeatLost));
  CHECK(fault.axis == 2);
  CHECK_THAT(rig.master.describe(fault),
             Catch::Contains("axis 2 'cable 2' (node 3)") && Catch::Contains("lost"));
  CHECK_FALSE(rig.measured.all_enabled);
  rig.follow_measured = false;
  rig.command.displacement = rig.measured.displacement;
  rig.command.displacement[0] += 5e-3;
  rig.run_for(100 * kMillisecond_ns);
  CHECK(rig.measured.displacement[0] == Approx(rig.command.displacement[0]).margin(1e-6));
  CHECK(rig.measured.fault.axis == 2);  // stays latched

  rig.plugs[2]->set_plugged(true);
  rig.run_for(500 * kMillisecond_ns);
  CHECK_FALSE(rig.measured.all_enabled);  // no return without reset
  REQUIRE(rig.reset());
  CHECK_FALSE(rig.faulted());
}

TEST_CASE("A silent drive is noticed by its heartbeat where its PDOs go on", "[unit]") {
  EnabledRig rig(config_of(2));
  rig.tamper = [](int axis, Frame& frame) { return !(axis == 1 && decode_heartbeat(frame, 2)); };
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kHeartbeatLost);
  CHECK(fault.axis == 1);
}

TEST_CASE("A drive whose positions stop is noticed while its heartbeat goes on", "[unit]") {
  EnabledRig rig(config_of(2));
  rig.tamper = [](int axis, Frame& frame) { return !(axis == 1 && frame.id == 0x182); };
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kFeedbackLost);
  CHECK(fault.axis == 1);
  CHECK_FALSE(rig.measured.all_known);
}

TEST_CASE("A drive's fault is latched with its code in words and cleared by reset", "[unit]") {
  EnabledRig rig(config_of(4));
  rig.drives[1].inject_fault(0x4310);
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kDriveFault);
  CHECK(fault.axis == 1);
  CHECK(fault.code == 0x4310);
  CHECK(rig.master.describe(fault) == "axis 1 'cable 1' (node 2): drive fault: drive too hot (EMCY 4310)");
  rig.run_for(1'000 * kMillisecond_ns);
  CHECK(rig.drives[1].state() == DriveState::kFault);  // not reset behind the operator's back
  CHECK(rig.reset());
}

TEST_CASE("An emergency is a fault although the drive goes on", "[unit]") {
  EnabledRig rig(config_of(2));
  rig.plugs[1]->send(encode_emergency(2, {.code = 0x8210}));
  const DriveFault fault = rig.fault(100 * kMillisecond_ns);
  CHECK(fault.kind == FaultKind::kDriveFault);
  CHECK(fault.axis == 1);
  CHECK(fault.code == 0x8210);
  rig.run_for(20 * kMillisecond_ns);
  CHECK(rig.drives[1].state() == DriveState::kSwitchOnDisabled);
}

TEST_CASE("A fault whose EMCY is late is latched by the statusword and then named", "[unit]") {
  EnabledRig rig(config_of(2));
  Frame held;
  rig.tamper = [&held](int axis, Frame& frame) {
    if (axis != 0 || decode_sdo_answer(frame, 1)) return axis != 0;
    if (!decode_emergency(frame, 1)) return true;
    held = frame;
    return false;
  };
  rig.drives[0].inject_fault(0x3210);
  CHECK(rig.fault().kind == FaultKind::kDriveFault);
  CHECK(rig.measured.fault.code == 0);
  CHECK_THAT(rig.master.describe(rig.measured.fault), Catch::Contains("no error code"));
  rig.plugs[0]->send(held);
  rig.run_for(5 * kMillisecond_ns);
  CHECK(rig.measured.fault.code == 0x3210);
}

TEST_CASE("A drive whose EMCY is lost, or older than we are, is asked what its fault is, even at the end",
          "[unit]") {
  const bool ends = GENERATE(false, true);
  CAPTURE(ends);
  Rig rig(config_of(2));
  rig.drives[0].inject_fault(0x3210);
  rig.tamper = [&rig](int axis, Frame& frame) {
    if (axis != 0) return true;
    rig.drives[0].inject_fault(0x3210);  // it does not clear
    return !decode_emergency(frame, 1);
  };
  rig.command.enable = true;
  CHECK(rig.fault().kind == FaultKind::kDriveFault);
  CHECK(rig.measured.fault.axis == 0);
  rig.command.enable = false;
  rig.command.finish = ends;
  rig.run_for(50 * kMillisecond_ns);
  CHECK(rig.master.describe(rig.measured.fault) ==
        "axis 0 'cable 0' (node 1): drive fault: overvoltage of the DC link (EMCY 3210)");
  CHECK(rig.measured.finished == ends);
}

TEST_CASE("A drive that reboots in operation is a fault, not a silent restart", "[unit]") {
  EnabledRig rig(config_of(2));
  rig.drives[1] = SimulatedCia402Drive({.node = 2, .position_counts = rig.drives[1].position()});
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kDriveRestarted);
  CHECK(fault.axis == 1);
  rig.run_for(500 * kMillisecond_ns);
  CHECK(rig.drives[1].state() == DriveState::kSwitchOnDisabled);
}

TEST_CASE("A drive that leaves operation by itself is a fault", "[unit]") {
  EnabledRig rig(config_of(2));
  rig.tamper = [](int axis, Frame& frame) {  // as with its safety input open
    if (axis == 0 && frame.id == 0x181) frame.data[0] = 0x50;
    return true;
  };
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kDriveDisabled);
  CHECK_THAT(rig.master.describe(fault), Catch::Contains("switch on disabled"));
}

TEST_CASE("A refused setting names object and reason", "[unit]") {
  Rig rig(config_of(2));
  rig.tamper = refusing({0x1017, 0}, SdoAbort::kBadValue);
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kConfiguration);
  CHECK(rig.master.describe(fault) ==
        "axis 1 'cable 1' (node 2): configuration failed at object 1017:0: value not allowed (SDO abort "
        "06090030)");
  rig.tamper = nullptr;
  rig.command.reset = true;
  rig.cycle();
  rig.command.reset = false;
  CHECK(rig.run_until([&] { return rig.measured.all_known; }));
}

TEST_CASE(
    "A drive that knows milliseconds alone is told a period of whole ones without touching its exponent",
    "[unit]") {
  MasterConfig config = config_of(2);
  config.period_ns = GENERATE(2'000'000, kPeriod_ns);
  Rig rig(config);
  rig.tamper = refusing({0x60C2, 2}, SdoAbort::kReadOnly, SdoAnswer::Kind::kWritten);  // it is -3
  const bool starts =
      rig.run_until([&] { return rig.measured.all_known || rig.faulted(); }) && !rig.faulted();
  CHECK(starts == (config.period_ns == 2'000'000));
  CHECK((rig.find("602#2FC2600102000000") >= 0) == starts);  // 2 ms
  if (!starts)
    CHECK_THAT(rig.master.describe(rig.measured.fault), Catch::Contains("60C2:2: object is read-only"));
}

TEST_CASE("A drive without an interpolation period of its own is used all the same", "[unit]") {
  Rig rig(config_of(2));
  rig.tamper = [first = refusing({0x60C2, 1}, SdoAbort::kNoObject),
                second = refusing({0x60C2, 2}, SdoAbort::kNoObject)](int axis, Frame& frame) {
    return first(axis, frame) && second(axis, frame);
  };
  CHECK(rig.enable());
}

TEST_CASE("A start that is given up leaves no drive behind that watches the master", "[unit]") {
  const bool refused = GENERATE(false, true);
  CAPTURE(refused);
  Rig rig(config_of(2));
  if (refused) rig.tamper = refusing({0x6060, 0}, SdoAbort::kBadValue);
  const char* told = "582#6016100100000000";
  REQUIRE(rig.run_until([&] { return refused ? rig.faulted() : rig.find(told) >= 0; }));
  REQUIRE(rig.find(told) >= 0);
  rig.command.finish = true;
  REQUIRE(rig.run_until([&] { return rig.measured.finished; }, 100 * kMillisecond_ns));
  rig.master_alive = false;
  rig.run_for(1'000 * kMillisecond_ns);
  for (const SimulatedCia402Drive& drive : rig.drives) CHECK(drive.state() == DriveState::kSwitchOnDisabled);
  CHECK(rig.find("082#3081110000000000") < 0);
}

TEST_CASE("An absent drive is a configuration fault with a time-out", "[unit]") {
  Rig rig(config_of(3));
  rig.plugs[1]->set_plugged(false);
  rig.command.enable = true;
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kConfiguration);
  CHECK(fault.axis == 1);
  rig.run_for(500 * kMillisecond_ns);
  CHECK(rig.drives[0].state() == DriveState::kSwitchOnDisabled);  // a robot is enabled whole or not at all
  CHECK_THAT(rig.master.describe(fault), Catch::Contains("(node 2): node 2 does not answer"));
}

TEST_CASE("Lost SDO answers are asked for again", "[unit]") {
  Rig rig(config_of(4));
  int count = 0;
  rig.tamper = [&count](int, Frame& frame) {
    return !(frame.id > 0x580 && frame.id < 0x600 && ++count % 7 == 0);
  };
  CHECK(rig.run_until([&] { return rig.measured.all_known; }, 20'000 * kMillisecond_ns));
  CHECK_FALSE(rig.faulted());
  CHECK(count > 20);
}

TEST_CASE("A drive that shows another mode than it was told is refused", "[unit]") {
  Rig rig(config_of(1));
  rig.command.enable = true;
  rig.tamper = [](int, Frame& frame) {
    const auto answer = decode_sdo_answer(frame, 1);
    if (answer && answer->object == ObjectAddress{0x6061, 0}) frame.data[4] = 1;
    return true;
  };
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kUnexpectedValue);
  CHECK(rig.master.describe(fault) ==
        "axis 0 'cable 0' (node 1): drive is set up otherwise: object 6061:0 (the mode of operation) reads "
        "0x1 and "
        "must read 0x8");
}

TEST_CASE("A drive that was up already and sends no boot-up message is configured all the same", "[unit]") {
  Rig rig(config_of(2));
  rig.tamper = [](int axis, Frame& frame) {
    return !(decode_heartbeat(frame, axis + 1) == NmtState::kBootUp);
  };
  CHECK(rig.run_until([&] { return rig.measured.all_known; }));
}

TEST_CASE("A drive that never enables is a time-out that tells its state", "[unit]") {
  Rig rig(config_of(2));
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.tamper = [](int axis, Frame& frame) {
    if (axis == 0 && frame.id == 0x181 && (frame.data[0] & 0x6F) != 0x40) frame.data[0] = 0x31;
    return true;
  };
  rig.run_for(100 * kMillisecond_ns);
  rig.command.enable = true;
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kEnableTimeout);
  CHECK(fault.axis == 0);
  CHECK_THAT(rig.master.describe(fault), Catch::Contains("ready to switch on"));
}

TEST_CASE("A drive that never gets ready to be enabled is a time-out that tells its state", "[unit]") {
  Rig rig(config_of(2));
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.tamper = [](int axis, Frame& frame) {
    if (axis == 0 && frame.id == 0x181) frame.data[0] = 0x10;
    return true;
  };
  rig.run_for(10 * config_of(2).enable_timeout_ns);
  CHECK(rig.measured.fault.kind == FaultKind::kNone);  // nobody has asked for it yet
  rig.command.enable = true;
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kEnableTimeout);
  CHECK(fault.axis == 0);
  CHECK_THAT(rig.master.describe(fault), Catch::Contains("not ready to switch on"));
}

TEST_CASE("A fault that does not clear at once is reset again, slowly, and reported in the end", "[unit]") {
  Rig rig(config_of(2));
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.tamper = [](int axis, Frame& frame) {
    if (axis == 0 && frame.id == 0x181) frame.data[0] = 0x18;
    return true;
  };
  rig.run_for(20 * kMillisecond_ns);
  CHECK_FALSE(rig.faulted());
  const auto from = static_cast<int>(rig.traffic.size());
  rig.command.enable = true;
  CHECK(rig.fault().kind == FaultKind::kDriveFault);
  int edges = 0, held = 0;
  std::vector<int> levels;  // cycles that each was held
  uint16_t last = 0;
  for (int k = from; k < static_cast<int>(rig.traffic.size()); ++k)
    if (const auto rpdo = decode_drive_command(0x201, rig.traffic[k])) {
      if (rpdo->controlword != last) {
        if (edges > 0) levels.push_back(held);
        edges += rpdo->controlword == kFaultReset ? 1 : 0;
        held = 0;
      }
      ++held;
      last = rpdo->controlword;
    }
  CHECK(edges > 10);
  REQUIRE(!levels.empty());
  levels.pop_back();                              // the fault cut it short
  CHECK(*std::ranges::min_element(levels) >= 6);  // cycles, 10 ms
}

TEST_CASE("The state of the bus becomes a fault of the whole robot", "[unit]") {
  const std::pair<BusHealth, FaultKind> rows[] = {{BusHealth::kPassive, FaultKind::kBusPassive},
                                                  {BusHealth::kOff, FaultKind::kBusOff},
                                                  {BusHealth::kDown, FaultKind::kBusDown}};
  for (const auto& [health, kind] : rows) {
    EnabledRig rig(config_of(2));
    rig.controller.set_health(health);
    rig.cycle();
    CAPTURE(name(kind));
    CHECK(rig.measured.fault.kind == kind);
    CHECK(rig.measured.fault.axis == -1);
    rig.run_for(1'000 * kMillisecond_ns);
    CHECK(rig.measured.fault.kind == kind);  // the cause, not what followed from it
    rig.command.reset = true;
    rig.run_for(10 * kMillisecond_ns);
    CHECK(rig.measured.fault.kind == kind);  // while it lasts reset does not help
    rig.controller.set_health(BusHealth::kActive);
    rig.run_for(10 * kMillisecond_ns);
    rig.command.reset = false;
    CHECK(rig.run_until([&] { return rig.measured.all_enabled; }));
    CHECK_FALSE(rig.faulted());
  }
}

TEST_CASE("A pause of the controller, in which drives are not asked for positions, is no fault of theirs",
          "[unit]") {
  EnabledRig rig(config_of(2));
  rig.bus.set_time(rig.bus.time_ns() + 80 * kMillisecond_ns);  // the feedback timeout is 50 ms
  rig.run_for(100 * kMillisecond_ns);
  CHECK(rig.measured.fault.kind == FaultKind::kNone);
  CHECK(rig.measured.all_enabled);
}

TEST_CASE("A position counts from its arrival, not from when it was read", "[unit]") {
  constexpr int64_t kDelay_ns = 100'000;
  EnabledRig rig(config_of(1), kDelay_ns);
  // Sent half a period before the cycle that reads it.
  const int64_t arrival_ns = rig.measured.stamp_ns - kPeriod_ns + kPeriod_ns / 2 + kDelay_ns;
  CHECK(rig.measured.displacement_stamp_ns[0] == arrival_ns);
}

}  // namespace tendril::hal::cia402_faults_test
