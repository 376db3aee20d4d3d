// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/cia402.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "hal/drive/axis_scale.h"

namespace tendril::hal::cia402_test {

constexpr DriveState kAll[] = {
    DriveState::kNotReady, DriveState::kSwitchOnDisabled, DriveState::kReady,         DriveState::kSwitchedOn,
    DriveState::kEnabled,  DriveState::kQuickStop,        DriveState::kFaultReaction, DriveState::kFault};

TEST_CASE("Every statusword is read by the masks of CiA 402", "[unit]") {
  struct Row {
    uint16_t mask, value;
    DriveState state;
  };
  const Row rows[] = {{0x4F, 0x00, DriveState::kNotReady},      {0x4F, 0x40, DriveState::kSwitchOnDisabled},
                      {0x6F, 0x21, DriveState::kReady},         {0x6F, 0x23, DriveState::kSwitchedOn},
                      {0x6F, 0x27, DriveState::kEnabled},       {0x6F, 0x07, DriveState::kQuickStop},
                      {0x4F, 0x0F, DriveState::kFaultReaction}, {0x4F, 0x08, DriveState::kFault}};
  for (int word = 0; word <= 0xFFFF; ++word) {
    DriveState expected = DriveState::kUnknown;
    for (const Row& row : rows)
      if ((word & row.mask) == row.value) expected = row.state;
    if (decode_statusword(static_cast<uint16_t>(word)) != expected) FAIL("statusword " << std::hex << word);
  }
  for (const DriveState state : kAll) CHECK(decode_statusword(encode_statusword(state)) == state);
}

TEST_CASE("Controlwords move a drive along the arrows of CiA 402 and along no other", "[unit]") {
  struct Arrow {
    DriveState from;
    uint16_t word;
    DriveState to;
  };
  using S = DriveState;
  const Arrow arrows[] = {{S::kSwitchOnDisabled, 0x06, S::kReady},
                          {S::kReady, 0x07, S::kSwitchedOn},
                          {S::kReady, 0x0F, S::kSwitchedOn},
                          {S::kReady, 0x00, S::kSwitchOnDisabled},
                          {S::kReady, 0x02, S::kSwitchOnDisabled},
                          {S::kSwitchedOn, 0x0F, S::kEnabled},
                          {S::kSwitchedOn, 0x06, S::kReady},
                          {S::kSwitchedOn, 0x00, S::kSwitchOnDisabled},
                          {S::kSwitchedOn, 0x02, S::kSwitchOnDisabled},
                          {S::kEnabled, 0x07, S::kSwitchedOn},
                          {S::kEnabled, 0x06, S::kReady},
                          {S::kEnabled, 0x00, S::kSwitchOnDisabled},
                          {S::kEnabled, 0x02, S::kQuickStop},
                          {S::kQuickStop, 0x0F, S::kEnabled},
                          {S::kQuickStop, 0x00, S::kSwitchOnDisabled},
                          {S::kFault, 0x80, S::kSwitchOnDisabled}};
  for (const DriveState from : kAll)
    for (const uint16_t word : std::initializer_list<uint16_t>{0x00, 0x02, 0x06, 0x07, 0x0F, 0x80}) {
      DriveState expected = from;
      for (const Arrow& arrow : arrows)
        if (arrow.from == from && arrow.word == word) expected = arrow.to;
      CAPTURE(name(from), word);
      CHECK(name(transition(from, word, 0)) == std::string(name(expected)));
    }
}

TEST_CASE("A fault is reset by the rising edge only", "[unit]") {
  CHECK(transition(DriveState::kFault, 0x80, 0x80) == DriveState::kFault);
  CHECK(transition(DriveState::kFault, 0x8F, 0x0F) == DriveState::kSwitchOnDisabled);
}

TEST_CASE("From every state the controlwords lead to enabled and back", "[unit]") {
  for (const DriveState start : kAll) {
    if (start == DriveState::kNotReady || start == DriveState::kFaultReaction)
      continue;  // left by themselves
    for (const DriveState goal : {DriveState::kEnabled, DriveState::kSwitchOnDisabled}) {
      if (start == DriveState::kFault && goal != DriveState::kEnabled) continue;
      DriveState state = start;
      uint16_t previous = 0;
      for (int step = 0; step < 5 && state != goal; ++step) {
        const uint16_t word = next_controlword(state, goal);
        state = transition(state, word, previous);
        previous = word;
      }
      CAPTURE(name(start));
      CHECK(state == goal);
    }
  }
}

TEST_CASE("The PDOs of the worked example have its bytes", "[unit]") {
  CHECK(to_text(encode_drive_command(0x202, {0x0F, 10000})) == "202#0F0010270000");
  CHECK(to_text(encode_drive_feedback(0x182, {0x0237, 10000})) == "182#370210270000");
  const auto feedback = decode_drive_feedback(0x182, *parse_frame("182#3702F0D8FFFF"));
  REQUIRE(feedback);
  CHECK(feedback->statusword == 0x0237);
  CHECK(feedback->position == -10000);
  CHECK(decode_statusword(feedback->statusword) == DriveState::kEnabled);
  const auto command = decode_drive_command(0x202, *parse_frame("202#0F0010270000"));
  REQUIRE(command);
  CHECK(command->target == 10000);
  CHECK_FALSE(decode_drive_feedback(0x182, *parse_frame("182#3702F0D8FF")));
  CHECK_FALSE(decode_drive_feedback(0x182, *parse_frame("183#3702F0D8FFFF")));
  CHECK(decode_drive_feedback(0x182, *parse_frame("182#3702F0D8FFFF0102"))->position ==
        -10000);  // the rest means nothing
}

TEST_CASE("The RPDO of torques has four bytes", "[unit]") {
  CHECK(to_text(encode_torque_command(0x202, {0x0F, -300})) == "202#0F00D4FE");
  const auto command = decode_torque_command(0x202, *parse_frame("202#0F00D4FE"));
  REQUIRE(command);
  CHECK(command->controlword == 0x0F);
  CHECK(command->torque == -300);
  CHECK_FALSE(decode_torque_command(0x203, *parse_frame("202#0F00D4FE")));
  CHECK_FALSE(decode_drive_command(0x202, *parse_frame("202#0F00D4FE")));
}

TEST_CASE("One turn of a drive is its displacement per turn, in metres of cable or cubic metres of fluid",
          "[unit]") {
  const double turn = GENERATE(2 * std::numbers::pi * 0.01, 1e-6);
  const AxisScale scale{.counts_per_turn = 65536, .displacement_per_turn = turn};
  CHECK(scale.to_displacement(65536) == Approx(turn));
  CHECK(scale.to_counts(turn) == 65536);
  const AxisScale reversed{.counts_per_turn = 65536, .displacement_per_turn = turn, .reversed = true};
  CHECK(reversed.to_counts(turn) == -65536);
  const AxisScale shifted{
      .counts_per_turn = 65536, .displacement_per_turn = turn, .reversed = true, .offset = turn / 4};
  CHECK(shifted.to_displacement(0) == Approx(turn / 4));
  CHECK(shifted.to_counts(0) == 16384);
  for (const AxisScale& s : {scale, reversed, shifted})
    for (int32_t counts : {0, 1, -1, 12345, -99999, 2'000'000'000})
      CHECK(s.to_counts(s.to_displacement(counts)) == counts);
  CHECK(scale.to_counts(1e9) == INT32_MAX);
  CHECK(scale.to_counts(-1e9) == INT32_MIN);
}

TEST_CASE(
    "The interpolation period is the nearest that object 60C2 can hold, in milliseconds where it can be",
    "[unit]") {
  const auto is = [](int64_t period_ns, int value, int exponent) {
    const InterpolationPeriod period = nearest_interpolation_period(period_ns);
    CAPTURE(period_ns);
    CHECK(int{period.value} == value);
    CHECK(int{period.exponent} == exponent);
  };
  is(1'000'000, 1, -3);    // 1 kHz
  is(2'000'000, 2, -3);    // 500 Hz
  is(10'000'000, 10, -3);  // 100 Hz
  is(2'500'000, 25, -4);   // 400 Hz
  is(255'000'000, 255, -3);
  is(300'000'000, 3, -1);
  is(1'666'667, 167, -5);  // 600 Hz: 1.67 ms
  is(1'250'000, 125, -5);  // 800 Hz
  is(250'000, 25, -5);     // 4 kHz
  is(125'000, 125, -6);    // 8 kHz
  for (int64_t period_ns = 26'000; period_ns < 1'000'000'000; period_ns += period_ns / 97) {
    const double error =
        std::abs(static_cast<double>(nearest_interpolation_period(period_ns).nanoseconds() - period_ns));
    CAPTURE(period_ns);
    CHECK(error <= 0.02 * static_cast<double>(period_ns));
  }
}

}  // namespace tendril::hal::cia402_test
