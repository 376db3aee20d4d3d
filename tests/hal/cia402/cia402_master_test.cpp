// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/cia402_master.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "tests/hal/rig.h"

namespace tendril::hal::cia402_master_test {
using namespace tendril::hal::test;

constexpr int64_t kMillisecond_ns = 1'000'000;

TEST_CASE("Start-up configures node 2 with the frames of the notes, in their order", "[unit]") {
  Rig rig(config_of(4));
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  const char* expected[] = {"000#8202",              // reset communication
                            "702#00",                // boot-up
                            "000#8002",              // pre-operational: some start by themselves
                            "602#4000100000000000",  // does it answer?
                            "602#4008100000000000",
                            "602#4009100000000000",
                            "602#400A100000000000",  // what it is called
                            "602#2B40600000000000",
                            "602#4041600000000000",  // no power
                            "602#2316100196007F00",
                            "602#2B17100032000000",  // heartbeats both ways
                            "602#2300140102020080",
                            "602#2F00160000000000",  // RPDO 1 off, map empty
                            "602#2300160110004060",
                            "602#2300160220007A60",  // 6040, 607A
                            "602#2F00160002000000",
                            "602#2F00140201000000",  // two objects, every SYNC
                            "602#2300140102020000",  // on
                            "602#23001801820100C0",
                            "602#2F001A0000000000",  // TPDO 1 likewise
                            "602#23001A0110004160",
                            "602#23001A0220006460",  // 6041, 6064
                            "602#2F001A0002000000",
                            "602#2F00180201000000",
                            "602#2300180182010040",
                            "602#2F60600008000000",
                            "582#6060600000000000",  // cyclic synchronous position
                            "602#40C2600100000000",
                            "602#2FC26001A7000000",
                            "602#40C2600200000000",
                            "602#2FC26002FB000000",  // 167 · 10⁻⁵ s
                            "000#0102",              // start
                            "702#05"};
  int at = 0;
  for (const char* text : expected) {
    CAPTURE(text);
    at = rig.find(text, at);
    REQUIRE(at >= 0);
  }
}

TEST_CASE("Drives tell what they are, those that can", "[unit]") {
  Rig rig(config_of(2));
  rig.tamper = [](int axis, Frame& frame) {
    const auto answer = decode_sdo_answer(frame, 2);
    if (axis == 1 && answer && answer->object.index >= 0x1008 && answer->object.index <= 0x100A)
      frame = encode_sdo_answer(
          2, {.kind = SdoAnswer::Kind::kAbort, .object = answer->object, .size = 0, .value = 0x06020000});
    return true;
  };
  CHECK(rig.master.identity(0).empty());
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  CHECK(rig.master.identity(0) ==
        "axis 0 'cable 0' (node 1): tendril-plant, hardware simulated, software 1.0");
  CHECK(rig.master.identity(1) == "axis 1 'cable 1' (node 2): a drive that does not tell its name");
}

TEST_CASE("A name is shown as far as it can be read", "[unit]") {
  Rig rig(config_of(1));
  rig.tamper = [](int, Frame& frame) {
    const auto answer = decode_sdo_answer(frame, 1);
    if (answer && answer->object == ObjectAddress{0x1008, 0})  // in one frame, with padding
      frame = encode_sdo_answer(
          1, {.kind = SdoAnswer::Kind::kValue, .object = answer->object, .size = 4, .value = 0x00200741});
    return true;
  };
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  CHECK_THAT(rig.master.identity(0), Catch::Contains(": A?, hardware"));
}

TEST_CASE("Any of the four pairs of PDOs serves an axis, with COB-IDs of its own", "[unit]") {
  MasterConfig config = config_of(2);
  cia402_settings(config.axes[0]) = {.pdo = GENERATE(1, 2, 3, 4), .rpdo_id = 0x442, .tpdo_id = 0x3C2};
  cia402_settings(config.axes[1]).pdo = 4;
  EnabledRig rig(config);
  rig.follow_measured = false;
  rig.command.displacement.fill(3e-3);
  rig.run_for(100 * kMillisecond_ns);
  for (int i = 0; i < 2; ++i) CHECK(rig.measured.displacement[i] == Approx(3e-3).margin(1e-6));
  for (const Frame& frame : rig.traffic) {
    const bool pdo = frame.id >= 0x180 && frame.id < 0x580;
    CHECK((!pdo || frame.id == 0x442 || frame.id == 0x3C2 || frame.id == 0x502 || frame.id == 0x482));
  }
}

TEST_CASE("Displacements are known before anything is enabled", "[unit]") {
  Rig rig(config_of(4));
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  CHECK(rig.measured.all_disabled);
  CHECK_FALSE(rig.measured.all_enabled);
  for (int i = 0; i < 4; ++i) {
    CAPTURE(i);
    const double sign = i % 2 == 1 ? -1 : 1;
    CHECK(rig.measured.displacement[i] == Approx(sign * 1000 * (i + 1) * 0.0628 / 65536));
    CHECK(rig.drives[i].state() == DriveState::kSwitchOnDisabled);
  }
  rig.run_for(1'000 * kMillisecond_ns);
  CHECK_FALSE(rig.faulted());
}

TEST_CASE("Enabling is no jump: the target is the position before 0F and until all are enabled", "[unit]") {
  Rig rig(config_of(4));
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.follow_measured = false;
  rig.command.displacement.fill(0.5);  // far away: must not be followed before all are enabled
  rig.command.enable = true;
  const auto from = static_cast<int>(rig.traffic.size());
  int slow = 50;  // cycles for which the last drive says "switched on" and no more
  rig.tamper = [&slow](int axis, Frame& frame) {
    if (axis == 3 && decode_drive_feedback(0x184, frame) && frame.data[0] == 0x37 && --slow > 0)
      frame.data[0] = 0x33;
    return true;
  };
  bool seen_0f[4] = {};
  while (!rig.measured.all_enabled && rig.traffic.size() < 90'000) {
    rig.cycle();
    if (rig.measured.all_enabled) break;  // from this cycle on commands are followed
    for (int i = 0; i < 4; ++i) CHECK(rig.drives[i].position() == 1000 * (i + 1));
  }
  REQUIRE(rig.measured.all_enabled);
  CHECK(slow <= 0);
  for (int i = 0; i < 4; ++i) {
    uint16_t last = 0;
    for (int k = from; k < static_cast<int>(rig.traffic.size()) && !seen_0f[i]; ++k)
      if (const auto rpdo = decode_drive_command(0x201 + i, rig.traffic[k])) {
        CHECK(rpdo->target == 1000 * (i + 1));
        if (rpdo->controlword != last)
          CHECK(rpdo->controlword == (last == 0 ? 0x06 : last == 0x06 ? 0x07 : 0x0F));
        last = rpdo->controlword;
        seen_0f[i] = last == 0x0F;
      }
    CHECK(seen_0f[i]);
  }
}

TEST_CASE("SYNC ends every cycle and follows all targets", "[unit]") {
  EnabledRig rig(config_of(4));
  for (int cycle = 0; cycle < 20; ++cycle) {
    rig.cycle();
    REQUIRE(rig.batch.size() >= 5);
    CHECK(to_text(rig.batch[rig.batch.size() - 1]) == "080#");
    for (int i = 0; i < 4; ++i)
      CHECK(rig.batch[rig.batch.size() - 5 + i].id == static_cast<uint32_t>(0x201 + i));
  }
}

TEST_CASE("Enabled drives follow the commanded lengths, each in its own sense", "[unit]") {
  EnabledRig rig(config_of(4));
  rig.follow_measured = false;
  for (int step = 0; step <= 300; ++step) {
    for (int i = 0; i < 4; ++i) rig.command.displacement[i] = 1e-3 * i + 20e-3 * step / 300;
    rig.cycle();
  }
  rig.run_for(100 * kMillisecond_ns);
  for (int i = 0; i < 4; ++i) {
    CHECK(rig.measured.displacement[i] == Approx(20e-3 + 1e-3 * i).margin(1e-6));
    CHECK((rig.drives[i].position() > 0) == (i % 2 == 0));
  }
  CHECK_FALSE(rig.faulted());
  rig.command.displacement.fill(std::nan(""));
  rig.run_for(10 * kMillisecond_ns);
  CHECK(rig.measured.displacement[0] == Approx(20e-3).margin(1e-6));  // holds
}

TEST_CASE("Frames that arrive a cycle late change nothing but the lag", "[unit]") {
  EnabledRig rig(config_of(4), 2 * kPeriod_ns + 1);
  rig.follow_measured = false;
  rig.command.displacement.fill(10e-3);
  rig.run_for(500 * kMillisecond_ns);
  CHECK_FALSE(rig.faulted());
  CHECK(rig.measured.displacement[3] == Approx(10e-3).margin(1e-6));
}

TEST_CASE("Thirty-two drives start a few at a time", "[unit]") {
  Rig rig(config_of(32));
  int most = 0, frames = 0;
  REQUIRE(rig.run_until([&] {
    int requests = 0;
    for (const Frame& frame : rig.batch) requests += frame.id >= 0x600 && frame.id < 0x680 ? 1 : 0;
    most = std::max(most, requests);
    frames = std::max(frames, rig.batch.size());
    return rig.measured.all_known;
  }));
  CHECK(most <= 4);
  CHECK(most > 1);
  rig.command.enable = true;
  CHECK(rig.run_until([&] {
    frames = std::max(frames, rig.batch.size());
    return rig.measured.all_enabled;
  }));
  CHECK(frames <= kWaitingCycles * frames_in_cycle(32));  // they may wait for the bus
  CHECK(rig.batch.dropped() == 0);
}

TEST_CASE("Drives are disabled by 07, 06, 00 and then let go", "[unit]") {
  EnabledRig rig(config_of(2));
  rig.run_for(20 * kMillisecond_ns);
  const auto from = static_cast<int>(rig.traffic.size());
  rig.command.enable = false;
  REQUIRE(rig.run_until([&] { return rig.measured.all_disabled; }));
  rig.run_for(20 * kMillisecond_ns);
  const int stop = rig.find("201#0700E8030000", from);
  const int shut = rig.find("201#0600E8030000", stop);
  CHECK(stop >= 0);
  CHECK(shut > stop);
  CHECK(rig.find("201#0000E8030000", shut) > shut);
  CHECK(rig.drives[0].state() == DriveState::kSwitchOnDisabled);

  rig.command.finish = true;
  REQUIRE(rig.run_until([&] { return rig.measured.finished; }));
  rig.master_alive = false;
  rig.run_for(1'000 * kMillisecond_ns);  // nobody minds that the master is gone
  for (const SimulatedCia402Drive& drive : rig.drives) {
    CHECK(drive.nmt_state() == NmtState::kPreOperational);
    CHECK(drive.state() == DriveState::kSwitchOnDisabled);
  }
}

TEST_CASE("Drives can be disabled and enabled again at any moment", "[unit]") {
  const int64_t delay_ns = GENERATE(0, 2 * kPeriod_ns + 1);
  CAPTURE(delay_ns);
  EnabledRig rig(config_of(3), delay_ns);
  for (int cycles = 1; cycles < 12; ++cycles) {
    CAPTURE(cycles);
    rig.command.enable = false;
    for (int i = 0; i < cycles; ++i) rig.cycle();
    rig.command.enable = true;
    REQUIRE(rig.run_until([&] { return rig.measured.all_enabled; }, 200 * kMillisecond_ns));
    REQUIRE_FALSE(rig.faulted());
  }
}

TEST_CASE("A stranger's frames change nothing", "[unit]") {
  EnabledRig rig(config_of(2));
  VirtualEndpoint& stranger = rig.bus.attach("stranger");
  for (const char* text : {"703#00", "183#080000000000", "083#1043090000000000", "583#8000100000000206",
                           "00000182#080000000000", "181#0800", "701#0505", "7FF#0102030405060708"})
    stranger.send(*parse_frame(text));
  rig.run_for(50 * kMillisecond_ns);
  CHECK_FALSE(rig.faulted());
  CHECK(rig.measured.all_enabled);
}

TEST_CASE("Sensors are heard beside CiA 402 drives, and grow stale", "[unit]") {
  MasterConfig config = config_of(1);
  config.sensors = {camera(0x1F0)};
  Rig rig(config);
  rig.run_for(500 * kMillisecond_ns);
  CHECK_FALSE(rig.measured.sensors.fresh[0]);
  const double seen[] = {0.01, 0.02, 0.125};
  rig.bus.attach("camera").send(*encode_sample(config.sensors[0], seen, 5 * kMillisecond_ns));
  const int64_t now_ns = rig.bus.time_ns();
  rig.cycle();
  CHECK(rig.measured.sensors.fresh[0]);
  CHECK(rig.measured.sensors.stamp_ns[0] == now_ns - 5 * kMillisecond_ns);
  CHECK(rig.measured.sensors.value[2] == Approx(0.125));
  rig.run_for(120 * kMillisecond_ns);
  CHECK_FALSE(rig.measured.sensors.fresh[0]);
}

TEST_CASE("The master gets along with the identifiers it names, in a whole life of the drives", "[unit]") {
  MasterConfig config = config_of(3);
  cia402_settings(config.axes[2]).tpdo_id = 0x3A5;
  config.sensors = {camera(0x7E0)};
  Rig rig(config);
  const std::vector<uint32_t> ids = rig.master.identifiers();
  const auto named = [&ids](const Frame& frame) {
    return std::find(ids.begin(), ids.end(), frame.id) != ids.end();
  };
  std::set<uint32_t> used;
  rig.tamper = [&](int, Frame& frame) {
    used.insert(frame.id);
    return named(frame);
  };
  REQUIRE(rig.enable());
  rig.drives[0].inject_fault(0x4310);
  rig.run_for(50'000'000);
  CHECK(rig.measured.fault.code == 0x4310);  // which only the emergency tells
  rig.command.enable = false;
  rig.command.finish = true;
  REQUIRE(rig.run_until([&] { return rig.measured.finished; }));
  CHECK(named({.id = 0x7E0}));
  // ... and names no more than the drives have used, those of emergencies and the camera, and its own: it
  // hears of another controller by them.
  const std::set<uint32_t> its_own = {0x080, 0x77F, 0x201, 0x202, 0x203};
  for (const uint32_t id : ids) {
    CAPTURE(id);
    CHECK((used.count(id) == 1 || its_own.count(id) == 1 || (id > 0x080 && id <= 0x083) || id == 0x7E0));
  }
}

}  // namespace tendril::hal::cia402_master_test
