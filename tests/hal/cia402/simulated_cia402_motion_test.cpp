// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/simulated_cia402_motion.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/hal/cia402/simulated_drive_bench.h"

// The motion of a simulated drive, commanded and observed by its frames.

namespace tendril::hal::simulated_cia402_motion_test {
using namespace tendril::hal::test;

constexpr int64_t kMillisecond_ns = 1'000'000;
// Counts from the switch at which the drive stops: 2000 counts/s, looked at once a millisecond.
constexpr double kEdge = 4;
constexpr double kOvershoot = 1.2;  // of a servo's acceleration, where that of its set-point jumps

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

}  // namespace tendril::hal::simulated_cia402_motion_test
