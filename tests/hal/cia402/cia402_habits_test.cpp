// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <functional>
#include <string>

#include "hal/canopen/emergency.h"
#include "hal/canopen/sdo.h"
#include "tests/hal/rig.h"

// Habits of drives in the field that are no faults.

namespace tendril::hal::cia402_habits_test {

using test::config_of, test::Rig;

constexpr int64_t kMillisecond_ns = 1'000'000;

/// A tamper that shows that value of 6061 on axis 0 while `late` says so.
auto showing_mode(Rig& rig, uint32_t value, std::function<bool()> late) {
  rig.tamper = [=](int axis, Frame& frame) {
    auto answer = decode_sdo_answer(frame, 1);
    if (axis != 0 || !answer || !(answer->object == ObjectAddress{0x6061, 0}) || !late()) return true;
    answer->value = value;
    frame = encode_sdo_answer(1, *answer);
    return true;
  };
}

TEST_CASE("A drive may show its mode late, or only with power", "[unit]") {
  SECTION("late") {
    Rig rig(config_of(2));
    showing_mode(rig, 0xFF, [&rig] { return rig.bus.time_ns() < 2'500 * kMillisecond_ns; });
    CHECK(rig.enable());
    CHECK(rig.bus.time_ns() >= 2'500 * kMillisecond_ns);  // it follows no target before
  }
  SECTION("only with power") {
    Rig rig(config_of(2));
    showing_mode(rig, 0, [&rig] { return rig.drives[0].state() != DriveState::kEnabled; });
    CHECK(rig.enable());
  }
}

TEST_CASE("Objects that are optional may be unanswered", "[unit]") {
  Rig rig(config_of(2));
  rig.tamper = [](int axis, Frame& frame) {
    const auto answer = decode_sdo_answer(frame, 1);
    const bool is_name = answer && answer->object.index >= 0x1008 && answer->object.index <= 0x100A;
    return !(axis == 0 && is_name);
  };
  CHECK(rig.enable());
  CHECK_THAT(rig.master.identity(0), Catch::Contains("does not tell its name"));
}

TEST_CASE("A drive may boot late, and answer late after it has booted", "[unit]") {
  MasterConfig config = config_of(2);
  config.start_timeout_ns = 5'000 * kMillisecond_ns;
  SECTION("SDO") {
    Rig rig(config);
    rig.tamper = [&rig](int axis, Frame& frame) {
      return !(axis == 1 && decode_sdo_answer(frame, 2) && rig.bus.time_ns() < 700 * kMillisecond_ns);
    };
    CHECK(rig.enable());
    CHECK_THAT(rig.master.identity(1), Catch::Contains("tendril-plant"));
  }
  SECTION("boot-up") {
    Rig rig(config);
    rig.plugs[1]->set_plugged(false);
    rig.run_for(3'500 * kMillisecond_ns);
    CHECK_FALSE(rig.faulted());
    rig.plugs[1]->set_plugged(true);
    rig.drives[1] = SimulatedCia402Drive({.node = 2});
    CHECK(rig.enable());
  }
  SECTION("never") {
    Rig rig(config);
    rig.plugs[1]->set_plugged(false);
    const DriveFault fault = rig.fault(10'000 * kMillisecond_ns);
    CHECK(rig.bus.time_ns() >= config.start_timeout_ns);
    CHECK_THAT(rig.master.describe(fault), Catch::Contains("node 2 does not answer"));
  }
}

TEST_CASE("SDO answers and emergencies may leave out the bytes at their end that mean nothing", "[unit]") {
  Rig rig(config_of(2));
  rig.tamper = [](int, Frame& frame) {
    for (const int node : {1, 2}) {
      const auto answer = decode_sdo_answer(frame, node);
      if (answer && answer->kind == SdoAnswer::Kind::kWritten) frame.length = 4;
      if (answer && answer->kind == SdoAnswer::Kind::kValue && answer->size != 0)
        frame.length = static_cast<uint8_t>(4 + answer->size);
      if (decode_emergency(frame, node)) frame.length = 3;
    }
    return true;
  };
  REQUIRE(rig.enable());
  rig.drives[1].inject_fault(0x4310);
  CHECK(rig.fault().code == 0x4310);
}

TEST_CASE("A PDO may be longer than its mapping, and is dropped where it is shorter", "[unit]") {
  for (const int change : {2, -1}) {
    Rig rig(config_of(1));
    rig.tamper = [change](int, Frame& frame) {
      if (frame.id == 0x181) frame.length = static_cast<uint8_t>(frame.length + change);
      return true;
    };
    CHECK(rig.enable() == (change > 0));
    if (change < 0) CHECK(rig.measured.fault.kind == FaultKind::kFeedbackLost);
  }
}

TEST_CASE("A drive that does not show its interpolation period, for whatever reason, is used as it is",
          "[unit]") {
  for (const SdoAbort reason : {SdoAbort::kNoObject, SdoAbort::kNoSubindex, SdoAbort::kGeneral}) {
    Rig rig(config_of(2));
    rig.tamper = [reason](int axis, Frame& frame) {
      const auto answer = decode_sdo_answer(frame, 1);
      if (axis == 0 && answer && answer->object.index == 0x60C2)
        frame = encode_sdo_answer(1, {SdoAnswer::Kind::kAbort, answer->object, 0, code(reason)});
      return true;
    };
    CHECK(rig.enable());
  }
}

TEST_CASE("An emergency that came before is part of every later reason, until it is taken back", "[unit]") {
  for (const bool taken_back : {false, true}) {
    Rig rig(config_of(2));
    REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
    VirtualEndpoint& drive = rig.bus.attach("emergency");
    drive.send(encode_emergency(2, {.code = 0x5530}));
    if (taken_back) drive.send(encode_emergency(2, {.code = 0}));
    rig.run_for(20 * kMillisecond_ns);
    CHECK_FALSE(rig.faulted());
    rig.plugs[1]->set_plugged(false);
    const DriveFault fault = rig.fault();
    CHECK(fault.kind != FaultKind::kDriveFault);
    CHECK((rig.master.describe(fault).find("before, it sent EMCY 5530") == std::string::npos) == taken_back);
  }
}

TEST_CASE("A second fault that a drive tells while the first is cleared is cleared too", "[unit]") {
  Rig rig(config_of(2));
  rig.drives[0].inject_fault(0x8130);
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  VirtualEndpoint& drive = rig.bus.attach("emergency");
  int64_t until_ns = 0;  // that time the second fault is there
  rig.tamper = [&](int axis, Frame& frame) {
    const auto emergency = decode_emergency(frame, 1);
    if (axis == 0 && emergency && emergency->code == 0 && until_ns == 0) {
      until_ns = rig.bus.time_ns() + 100 * kMillisecond_ns;
      drive.send(encode_emergency(1, {.code = 0x3220}));
      return false;
    }
    if (frame.id == 0x181 && rig.bus.time_ns() < until_ns) frame.data[0] = 0x18;
    return true;
  };
  CHECK(rig.enable());
  CHECK(until_ns != 0);
}

}  // namespace tendril::hal::cia402_habits_test
