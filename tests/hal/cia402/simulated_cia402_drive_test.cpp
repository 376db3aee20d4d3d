// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/simulated_cia402_drive.h"

#include <catch2/catch.hpp>

#include "tests/hal/cia402/simulated_drive_bench.h"

namespace tendril::hal::simulated_cia402_drive_test {
using namespace tendril::hal::test;

constexpr int64_t kMillisecond_ns = 1'000'000;

TEST_CASE("A drive announces itself and then waits in pre-operational", "[unit]") {
  Bench bench;
  CHECK(bench.advance(0) == Texts{"702#00"});
  CHECK(bench.drive.nmt_state() == NmtState::kPreOperational);
  CHECK(bench.drive.state() == DriveState::kSwitchOnDisabled);
  CHECK(bench.advance(kMillisecond_ns).empty());
  CHECK(bench.say("000#8102").empty());
  CHECK(bench.advance(0) == Texts{"702#00"});
  CHECK(bench.say("000#0103").empty());  // for another node
  CHECK(bench.drive.nmt_state() == NmtState::kPreOperational);
  bench.say("000#0100");  // for all
  CHECK(bench.drive.nmt_state() == NmtState::kOperational);
}

TEST_CASE("Targets take effect at SYNC and the answer tells state and position", "[unit]") {
  Bench bench;
  bench.set_up();
  bench.say("202#0600F4010000");
  CHECK(bench.drive.state() == DriveState::kSwitchOnDisabled);  // not before SYNC
  CHECK(bench.say("080#") == Texts{"182#3102F4010000"});
  CHECK(bench.say("202#0700F4010000").empty());
  CHECK(bench.say("080#") == Texts{"182#3302F4010000"});
  bench.say("202#0F00F4010000");
  CHECK(bench.say("080#") == Texts{"182#3712F4010000"});  // enabled, follows the command
}

TEST_CASE("A CiA 402 drive answers no remote frame, not one with the identifier of SYNC either", "[unit]") {
  Bench bench;
  bench.set_up();
  for (const char* text : {"080#R", "182#R", "202#R", "602#R", "702#R"}) CHECK(bench.say(text).empty());
  CHECK(bench.say("080#").size() == 1);
}

TEST_CASE("What a drive tells of its position is in whole counts, and SDO tells what PDO does", "[unit]") {
  Bench bench;
  bench.set_up();
  bench.enable();
  for (int32_t target = 501; target < 700; target += 3) {
    const auto answers = bench.cycle(0x0F, target);
    const double position = bench.drive.position();
    const auto told = decode_drive_feedback(0x182, *parse_frame(bench.say("080#").back()));
    CHECK(told->position == std::lround(position));
    CHECK(decode_sdo_answer(*parse_frame("582#" + bench.sdo("4064600000000000")), 2)->value ==
          static_cast<uint32_t>(told->position));
  }
}

TEST_CASE("A drive stops by itself, holds and reports 8130 when the master's heartbeat ends", "[unit]") {
  Bench bench;
  bench.set_up();
  REQUIRE(bench.sdo("2316100196007F00") == "6016100100000000");  // node 127, 150 ms
  bench.advance(1000 * kMillisecond_ns);
  CHECK(bench.drive.state() == DriveState::kSwitchOnDisabled);  // watched from the first heartbeat on
  bench.enable();
  bench.say("77F#05");
  bench.advance(149 * kMillisecond_ns);
  bench.say("77F#05");
  bench.advance(149 * kMillisecond_ns);
  CHECK(bench.drive.state() == DriveState::kEnabled);
  bench.say("202#0F00FFFFFF0F");  // a long way to go
  bench.say("080#");
  const auto answers = bench.advance(2 * kMillisecond_ns);
  CHECK(std::count(answers.begin(), answers.end(), "082#3081110000000000") == 1);
  const double stopped = bench.drive.position();
  bench.advance(1000 * kMillisecond_ns);
  CHECK(bench.drive.position() == stopped);
  CHECK(bench.drive.state() == DriveState::kFault);
  CHECK(bench.drive.nmt_state() == NmtState::kPreOperational);
}

TEST_CASE("A fault stops the motion and is cleared by the edge of bit 7 alone", "[unit]") {
  Bench bench;
  bench.set_up();
  bench.enable();
  bench.cycle(0x0F, 600);
  bench.drive.inject_fault(0x4310);
  const auto answers = bench.advance(0);
  CHECK(std::count(answers.begin(), answers.end(), "082#1043090000000000") == 1);
  CHECK(bench.drive.state() == DriveState::kFaultReaction);
  const double stopped = bench.drive.position();
  bench.cycle(0x0F, 900);
  CHECK(bench.drive.position() == stopped);
  CHECK(bench.drive.state() == DriveState::kFault);
  CHECK(bench.sdo("4001100000000000") == "4F01100009000000");  // error register: generic, temperature
  CHECK(bench.sdo("403F600000000000") == "4B3F600010430000");  // error code
  const auto cleared = bench.cycle(0x80, 600);
  CHECK(cleared.front() == "082#0000000000000000");
  CHECK(bench.drive.state() == DriveState::kSwitchOnDisabled);
  CHECK(bench.sdo("403F600000000000") == "4B3F600000000000");
  bench.drive.inject_fault(0x4310);
  bench.advance(0);
  bench.advance(0);
  bench.cycle(0x80, 600);  // no edge: the bit is still set
  CHECK(bench.drive.state() == DriveState::kFault);
}

TEST_CASE("A drive that is following must not be taken out of operation unnoticed", "[unit]") {
  for (const char* order : {"000#0202", "000#8002"}) {
    CAPTURE(order);
    Bench bench;
    bench.set_up();
    bench.enable();
    bench.say(order);
    Texts said = bench.advance(kMillisecond_ns);
    for (const std::string& more : bench.advance(kMillisecond_ns)) said.push_back(more);
    CHECK(bench.drive.state() == DriveState::kFault);
    // Nodes that are stopped send no EMCY.
    CHECK(std::count(said.begin(), said.end(), "082#0081110000000000") == (order[4] == '8' ? 1 : 0));
  }
}

}  // namespace tendril::hal::simulated_cia402_drive_test
