#include "hal/cia402/simulated_cia402_drive.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/hal/cia402/simulated_drive_bench.h"

namespace tendril::hal::simulated_cia402_drive_test {
using namespace tendril::hal::test;

constexpr int64_t kMillisecond_ns = 1'000'000;
// Counts from the switch at which the drive stops: 2000 counts/s, looked at once a millisecond.
constexpr double kEdge = 4;
constexpr double kOvershoot = 1.2;  // of a servo's acceleration, where that of its set-point jumps

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

TEST_CASE("A jammed drive stays where it is and fails once it strays from its following-error window",
          "[unit]") {
  Bench bench;
  bench.set_up();
  bench.sdo("23656000E8030000");  // 6065 = 1000 counts
  bench.enable();
  bench.drive.set_jammed(true);
  for (int k = 0; k < 3; ++k) bench.cycle(0x0F, 1500);  // 1000 away: just within
  CHECK(bench.drive.state() == DriveState::kEnabled);
  CHECK(bench.drive.position() == 500);
  for (int k = 0; k < 2; ++k) bench.cycle(0x0F, 1501);
  bench.advance(0);
  CHECK(bench.drive.state() == DriveState::kFault);
  CHECK(bench.drive.position() == 500);
}

TEST_CASE("The object dictionary answers with values or with the right abort code", "[unit]") {
  Bench bench;
  bench.advance(0);
  CHECK(bench.sdo("4000100000000000") == "4300100092010200");  // 1000: servo drive, profile 402
  CHECK(bench.sdo("4018100000000000") == "4F18100004000000");  // 1018:0
  CHECK(bench.sdo("4005100000000000") == "4305100080000000");  // 1005: SYNC is 080
  CHECK(bench.sdo("4014100000000000") == "4314100082000000");  // 1014: EMCY is 080 + node
  CHECK(bench.sdo("4002650000000000") == "43026500A0020000");  // 6502: bits 5, 7 and 9: homing, CSP and CST
  CHECK(bench.sdo("4064600000000000") == "43646000F4010000");  // 6064 = 500
  CHECK(bench.sdo("4041600000000000") == "4B41600050020000");  // 6041: switch on disabled, remote, voltage
  CHECK(bench.sdo("2F60600008000000") == "6060600000000000");  // 6060 = 8
  CHECK(bench.sdo("4061600000000000") == "4F61600008000000");  // 6061 = 8
  CHECK(bench.sdo("2260600008000000") == "6060600000000000");  // size not said
  CHECK(bench.sdo("2F60600001000000") == "8060600030000906");  // 6060 = 1: value not allowed
  CHECK(bench.sdo("4034120000000000") == "8034120000000206");  // no such object
  CHECK(bench.sdo("4018100500000000") == "8018100511000906");  // no such subindex
  CHECK(bench.sdo("2B41600000000000") == "8041600002000106");  // 6041 is read-only
  CHECK(bench.sdo("2360600008000000") == "8060600012000706");  // too long
  CHECK(bench.sdo("2F7A600008000000") == "807A600013000706");  // too short
  CHECK(bench.sdo("2FC2600100000000") == "80C2600132000906");  // 60C2:1 = 0: too low
  CHECK(bench.sdo("2FC2600201000000") == "80C2600231000906");  // 60C2:2 = 1: too high
  CHECK(bench.sdo("2118100100000000") == "8018100101000405");  // segmented
  bench.say("000#0202");
  CHECK(bench.sdo("4000100000000000") == "no answer");  // stopped nodes speak no SDO
}

TEST_CASE("A drive tells its name in segments, and keeps to the toggle bit", "[unit]") {
  Bench bench;
  bench.advance(0);
  CHECK(bench.sdo("4008100000000000") == "410810000D000000");  // 13 bytes
  CHECK(bench.sdo("6000000000000000") == "0074656E6472696C");  // "tendril"
  CHECK(bench.sdo("7000000000000000") == "132D706C616E7400");  // "-plant", the last
  CHECK(bench.sdo("6000000000000000") == "8008100001000405");  // there is no more
  CHECK(bench.sdo("4008100000000000") == "410810000D000000");
  CHECK(bench.sdo("7000000000000000") == "8008100000000305");  // toggle bit not alternated
  CHECK(bench.sdo("6000000000000000") == "8008100001000405");  // which has ended the transfer
  bench.sdo("4008100000000000");
  CHECK(bench.sdo("8008100000000405") == "no answer");
  CHECK(bench.sdo("6000000000000000") == "8008100001000405");  // as does an abort
  CHECK(bench.sdo("4008100100000000") == "8008100111000906");  // no such subindex
  CHECK(bench.sdo("2308100061626364") == "8008100002000106");  // read-only
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

TEST_CASE("A drive interpolates between targets over its period and not faster than it can", "[unit]") {
  Bench bench({.node = 2, .top_speed = 60'000, .position_counts = 500});
  bench.set_up();
  bench.enable();
  constexpr double kTick =
      42'000 * 1e-9 * SimulatedServo::kTick_ns;  // counts: its position is that of its last tick
  int32_t target = 500;
  for (int k = 0; k < 100; ++k) bench.cycle(0x0F, target += 70);  // 42 000 counts/s
  CHECK(bench.drive.position() == Approx(target).margin(kTick));
  bench.say(to_text(encode_drive_command(0x202, {0x0F, target + 70})));
  bench.say("080#");
  bench.advance(kPeriod_ns / 2);
  CHECK(bench.drive.position() == Approx(target + 35).margin(kTick));
  const auto travel = [&] {
    const double before = bench.drive.position();
    bench.cycle(0x0F, 1'000'000);
    return bench.drive.position() - before;
  };
  for (int k = 0; k < 20; ++k) travel();
  for (int k = 0; k < 20; ++k) CHECK(travel() <= 60'000 * (1e-9 * kPeriod_ns + 1.25e-4));
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

TEST_CASE("A load beyond its force limit drags an enabled drive out of its following-error window",
          "[unit]") {
  const auto [load, fails] = GENERATE(table<double, bool>({{0.99, false}, {1.5, true}, {-1.5, true}}));
  CAPTURE(load);
  Bench bench({.node = 2, .top_speed = 60'000, .position_counts = 500, .error_window = 1000});
  bench.set_up();
  bench.enable();
  bench.drive.set_load(load);
  for (int k = 0; k < 100; ++k) bench.cycle(0x0F, 500);
  CHECK((bench.drive.state() == DriveState::kFault) == fails);
  CHECK((bench.drive.position() == 500) == !fails);
}

TEST_CASE("A following error that lasts no longer than 6066 allows is no fault", "[unit]") {
  Bench bench({.node = 2, .top_speed = 60'000, .position_counts = 500, .error_window = 50});
  bench.set_up();
  CHECK(bench.sdo("2B66600014000000").substr(0, 2) == "60");  // 20 ms
  bench.enable();
  bench.cycle(0x0F, 1000);  // takes 8 ms and some
  for (int k = 0; k < 50; ++k) bench.cycle(0x0F, 1000);
  CHECK(bench.drive.state() == DriveState::kEnabled);
  for (int k = 0; k < 50; ++k) bench.cycle(0x0F, 3000);  // 33 ms
  CHECK(bench.drive.state() == DriveState::kFault);
}

TEST_CASE("A drive that is not enabled does not move", "[unit]") {
  Bench bench;
  bench.set_up();
  for (const uint16_t word : std::initializer_list<uint16_t>{0x06, 0x07}) {
    bench.cycle(word, 9000);
    CHECK(bench.drive.position() == 500);
  }
  bench.cycle(0x0F, 600);
  CHECK(bench.drive.position() > 500);
  bench.cycle(0x0F, 100'000);
  bench.say("202#0200A0860100");
  bench.say("080#");
  const double stopped = bench.drive.position();
  CHECK(bench.drive.state() == DriveState::kQuickStop);
  bench.advance(100 * kMillisecond_ns);
  CHECK(bench.drive.position() == stopped);
}

TEST_CASE("Soft limits clamp the target and are reported", "[unit]") {
  Bench bench;
  bench.set_up();
  CHECK(bench.sdo("237D600100000000").substr(0, 2) == "60");  // min 0
  CHECK(bench.sdo("237D600258020000").substr(0, 2) == "60");  // max 600
  bench.enable();
  bench.cycle(0x0F, 700);
  bench.advance(100 * kMillisecond_ns);
  const auto answers = bench.cycle(0x0F, 700);
  CHECK(bench.drive.position() == Approx(600));
  CHECK(decode_drive_feedback(0x182, *parse_frame(answers.back()))->statusword & kInternalLimit);
}

TEST_CASE("A following error beyond the window is a fault", "[unit]") {
  Bench bench({.node = 2, .top_speed = 1000, .position_counts = 500});
  bench.set_up();
  CHECK(bench.sdo("2365600064000000").substr(0, 2) == "60");  // 100 counts
  bench.enable();
  bench.cycle(0x0F, 550);
  CHECK(bench.drive.state() == DriveState::kEnabled);
  bench.cycle(0x0F, 5000);
  const auto answers = bench.cycle(0x0F, 5000);
  REQUIRE(answers.size() == 2);
  CHECK(answers[0].substr(0, 8) == "082#1186");
  CHECK(decode_drive_feedback(0x182, *parse_frame(answers[1]))->statusword & kFollowingError);
  CHECK(bench.drive.state() == DriveState::kFault);
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

TEST_CASE("A drive has four homing methods and refuses others", "[unit]") {
  Bench bench;
  bench.advance(0);
  for (const char* method : {"11", "12", "23", "25"})
    CHECK(bench.sdo("2F986000" + std::string(method) + "000000") == "6098600000000000");
  for (const char* method : {"01", "13", "21", "FF"})
    CHECK(bench.sdo("2F986000" + std::string(method) + "000000") == "8098600030000906");  // value not allowed
}

TEST_CASE("Homing goes on while bit 4 is set, tells how far it is, and leaves other modes alone", "[unit]") {
  Bench bench({.node = 2, .position_counts = 500, .incremental = true});
  bench.set_up();
  CHECK(bench.sdo("4064600000000000") == "4364600000000000");  // counts from power-on
  bench.sdo("2F98600011000000");
  const auto status = [&](uint16_t word) {
    return decode_drive_feedback(0x182, *parse_frame(bench.cycle(word, 0).back()))->statusword;
  };
  bench.sdo("2F60600006000000");
  for (const uint16_t word : std::initializer_list<uint16_t>{0x06, 0x07, 0x0F, 0x0F}) bench.cycle(word, 0);
  CHECK((status(0x0F) & 0x3400) == kTargetReached);  // not started
  CHECK(bench.drive.position() == 500);
  CHECK((status(0x1F) & 0x3400) == 0);  // in progress
  for (int k = 0; k < 5; ++k) bench.cycle(0x1F, 0);
  const double interrupted = bench.drive.position();
  CHECK(interrupted < 500);
  CHECK((status(0x0F) & 0x3400) == kTargetReached);
  bench.cycle(0x0F, 0);
  CHECK(bench.drive.position() == interrupted);
  for (int k = 0; k < 600; ++k) bench.cycle(0x1F, 0);
  CHECK((status(0x1F) & 0x3400) == (kTargetReached | kHomingAttained));
  CHECK(bench.drive.position() == Approx(0).margin(kEdge));
  bench.sdo("2F60600008000000");
  CHECK((status(0x0F) & 0x3400) == kFollowsCommand);
}

TEST_CASE("A homing search that lost its power or its mode is over until it is started again", "[unit]") {
  const bool by_mode = GENERATE(false, true);
  CAPTURE(by_mode);
  Bench bench({.node = 2, .position_counts = 500, .incremental = true});
  bench.set_up();
  bench.sdo("2F98600011000000");
  bench.sdo("2F60600006000000");
  for (const uint16_t word : std::initializer_list<uint16_t>{0x06, 0x07, 0x0F, 0x1F, 0x1F, 0x1F})
    bench.cycle(word, 500);
  const double left = bench.drive.position();
  REQUIRE(left < 500);
  if (by_mode) {
    bench.sdo("2F60600008000000");
    bench.cycle(0x1F, static_cast<int32_t>(std::lround(left - 500)));
    bench.sdo("2F60600006000000");
  } else {
    bench.cycle(0x17, 0);
  }
  const double resting = bench.drive.position();
  for (int k = 0; k < 10; ++k) bench.cycle(0x1F, 0);
  REQUIRE(bench.drive.state() == DriveState::kEnabled);
  CHECK(bench.drive.position() == resting);
  bench.cycle(0x0F, 0);
  for (int k = 0; k < 10; ++k) bench.cycle(0x1F, 0);
  CHECK(bench.drive.position() < resting);
}

TEST_CASE("A node that is reset has forgotten its controlword and its homing", "[unit]") {
  Bench bench;
  const auto home = [&bench](std::initializer_list<uint16_t> words) {
    bench.set_up();
    bench.sdo("2F98600025000000");
    bench.sdo("2F60600006000000");
    uint16_t status = 0;
    for (const uint16_t word : words)
      status = decode_drive_feedback(0x182, *parse_frame(bench.cycle(word, 0).back()))->statusword;
    return status;
  };
  CHECK(home({0x06, 0x07, 0x0F, 0x1F, 0x1F}) & kHomingAttained);
  bench.cycle(0x80, 0);
  bench.say("000#8102");
  CHECK_FALSE(home({0x06, 0x07, 0x0F, 0x0F}) & kHomingAttained);
  bench.cycle(0x80, 0);
  bench.say("000#8102");
  bench.set_up();
  bench.drive.inject_fault(0x4310);
  for (int k = 0; k < 2; ++k) bench.advance(kMillisecond_ns);
  bench.cycle(0x80, 0);  // an edge: bit 7 was set before the reset alone
  CHECK(bench.drive.state() == DriveState::kSwitchOnDisabled);
}

TEST_CASE("Halt stops what a drive follows, with its power on, and its end lets it go on", "[unit]") {
  Bench bench;
  bench.set_up();
  bench.enable();
  for (int32_t target = 510; target < 600; target += 10) bench.cycle(0x0F, target);
  const auto status = [&](uint16_t word, int32_t target) {
    return decode_drive_feedback(0x182, *parse_frame(bench.cycle(word, target).back()))->statusword;
  };
  CHECK_FALSE(status(0x10F, 700) & kFollowsCommand);
  const double halted = bench.drive.position();
  CHECK(halted < 610);
  for (int k = 0; k < 10; ++k) CHECK(decode_statusword(status(0x10F, 700)) == DriveState::kEnabled);
  CHECK(bench.drive.position() == halted);
  CHECK(status(0x0F, 700) & kFollowsCommand);
  bench.advance(50 * kMillisecond_ns);
  CHECK(bench.drive.position() == Approx(700).margin(0.1));
}

TEST_CASE("Halt makes a homing search pause", "[unit]") {
  Bench bench({.node = 2, .position_counts = 500, .incremental = true});
  bench.set_up();
  bench.sdo("2F98600011000000");
  bench.sdo("2F60600006000000");
  const auto status = [&](uint16_t word) {
    return decode_drive_feedback(0x182, *parse_frame(bench.cycle(word, 0).back()))->statusword;
  };
  for (const uint16_t word : std::initializer_list<uint16_t>{0x06, 0x07, 0x0F, 0x1F, 0x1F})
    bench.cycle(word, 0);
  status(0x11F);
  const double halted = bench.drive.position();
  for (int k = 0; k < 10; ++k) CHECK((status(0x11F) & 0x3400) == kTargetReached);  // stands, not attained
  CHECK(bench.drive.position() == halted);
  for (int k = 0; k < 600; ++k) bench.cycle(0x1F, 0);
  CHECK((status(0x1F) & 0x3400) == (kTargetReached | kHomingAttained));
}

TEST_CASE("A drive tells how it stops, and has no other way", "[unit]") {
  Bench bench;
  bench.advance(0);
  CHECK(bench.sdo("4007600000000000") == "4B07600001000000");  // connection lost: fault
  CHECK(bench.sdo("405A600000000000") == "4B5A600006000000");  // quick stop: stays in it
  CHECK(bench.sdo("405D600000000000") == "4B5D600001000000");  // halt: stays in "operation enabled"
  CHECK(bench.sdo("2B5A600006000000") == "605A600000000000");
  for (const char* object : {"0760", "5A60", "5D60"})
    CHECK(bench.sdo("2B" + std::string(object) + "0002000000") == "80" + std::string(object) + "0030000906");
}

TEST_CASE("Homing keeps to its speeds and acceleration, however long the steps of time", "[unit]") {
  Bench bench({.node = 2, .position_counts = 20'000, .incremental = true});
  bench.set_up();
  bench.sdo("2F98600011000000");
  bench.sdo("2399600110270000");  // 10 000 counts/s
  bench.sdo("239A6000A0860100");  // 100 000 counts/s²
  bench.sdo("2F60600006000000");
  for (const uint16_t word : std::initializer_list<uint16_t>{0x06, 0x07, 0x0F, 0x0F, 0x1F})
    bench.cycle(word, 0);
  double last = bench.drive.position(), speed = 0, fastest = 0;
  for (int k = 0; k < 800; ++k) {
    bench.advance(5 * kMillisecond_ns);
    const double v = (last - bench.drive.position()) / 5e-3;
    if (k > 0 && v > 0) CHECK(v - speed <= 100'000 * 5e-3 * kOvershoot);
    CHECK(v >= -2'000 * kOvershoot);  // back from the switch at 6099:2
    fastest = std::max(fastest, v);
    speed = v;
    last = bench.drive.position();
  }
  CHECK(fastest == Approx(10'000).epsilon(0.02));
  CHECK(last == Approx(0).margin(5 * kEdge));
}

TEST_CASE("In torque mode a drive turns until its load equals the target torque, within what it holds",
          "[unit]") {
  const auto [thousandths, balance] = GENERATE(table<int, double>({{300, 300}, {-200, -200}, {5000, 2000}}));
  CAPTURE(thousandths);
  Bench bench({.node = 2,
               .rpdo_id = 0x202,
               .tpdo_id = 0x182,
               .top_speed = 1e5,
               .tuning = {.friction = 0.2},
               .rpdo_target = kMapTargetTorque,
               .rated_torque_mNm = 500,
               .torque_limit = 2});
  bench.advance(0);
  CHECK(bench.sdo("4002650000000000") == "43026500A0020000");  // modes 6, 8 and 10
  CHECK(bench.sdo("4076600000000000") == "43766000F4010000");
  CHECK(bench.sdo("2F6060000A000000") == "6060600000000000");
  CHECK(bench.sdo("4061600000000000") == "4F6160000A000000");
  bench.say("000#0102");
  const auto push = [&, thousandths = thousandths](uint16_t word) {
    bench.say(to_text(encode_torque_command(0x202, {word, static_cast<int16_t>(thousandths)})));
    const auto answers = bench.say("080#");
    bench.advance(kPeriod_ns);
    return answers;
  };
  for (const uint16_t word : std::initializer_list<uint16_t>{0x06, 0x07}) push(word);
  CHECK(bench.drive.position() == 0);  // no power, no torque
  constexpr double kSpring = 0.2;      // thousandths of the rated torque a count
  std::vector<std::string> answers;
  for (int k = 0; k < 1500; ++k) {
    answers = push(0x0F);
    bench.drive.set_load(kSpring * bench.drive.position() / 2000);
  }
  CHECK(kSpring * bench.drive.position() == Approx(balance).epsilon(1e-3));
  CHECK((decode_drive_feedback(0x182, *parse_frame(answers.at(0)))->statusword & kFollowsCommand) != 0);
  const auto torque = decode_sdo_answer(*parse_frame("582#" + bench.sdo("4077600000000000")), 2);
  CHECK(static_cast<int16_t>(torque->value) == Approx(balance).margin(2));
  const double stood = bench.drive.position();
  bench.drive.set_load(0);
  push(0x00);
  bench.advance(100 * kMillisecond_ns);
  CHECK(bench.drive.position() == stood);  // without power it stands
}

TEST_CASE("A torque has two bytes, and its unit is no entry of a TPDO", "[unit]") {
  Bench bench;
  bench.advance(0);
  CHECK(bench.sdo("2B71600000FC0000") == "6071600000000000");
  CHECK(bench.sdo("4071600000000000") == "4B71600000FC0000");
  CHECK(bench.sdo("2371600000000000") == "8071600012000706");  // too long
  CHECK(bench.sdo("2376600001000000") == "8076600002000106");  // read only
  CHECK(bench.sdo("23001A0120007660") == "80001A0141000406");  // not mappable there
}

}  // namespace tendril::hal::simulated_cia402_drive_test
