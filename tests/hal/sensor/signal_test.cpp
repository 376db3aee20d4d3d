// SPDX-License-Identifier: Apache-2.0
#include "hal/sensor/signal.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "tests/hal/heap_count.h"

namespace tendril::hal::signal_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Bit `k` of the signal, 0 the least significant, found by walking through the frame as a DBC numbers it.
bool bit_by_walking(const Signal& signal, const Frame& frame, int k) {
  int bit = signal.start;
  if (signal.order == ByteOrder::kIntel) {
    bit += k;
  } else {
    for (int step = signal.length - 1; step > k; --step) bit = bit % 8 == 0 ? bit + 15 : bit - 1;
  }
  return frame.data[bit / 8] >> (bit % 8) & 1;
}

/// Calls `judge` with every place that an unsigned signal can have in 8 bytes.
template <typename Judge>
void for_every_place(const Judge& judge) {
  for (const ByteOrder order : {ByteOrder::kIntel, ByteOrder::kMotorola})
    for (int start = 0; start < 64; ++start)
      for (int length = 1; length <= 64; ++length) {
        const Signal signal{.name = "s", .start = start, .length = length, .order = order};
        if (bytes_needed(signal) <= 8) judge(signal);
      }
}

TEST_CASE("The bits of a signal are those that walking through the frame meets", "[law]") {
  for_every_place([](const Signal& signal) {
    uint64_t met = 0;
    for (int bit = 0; bit < 64; ++bit) {
      Frame frame{.length = 8};
      frame.data[bit / 8] = static_cast<uint8_t>(1 << (bit % 8));
      for (int k = 0; k < signal.length; ++k)
        if (bit_by_walking(signal, frame, k)) met |= uint64_t{1} << bit;
    }
    if (bits_of(signal) != met) FAIL("start " << signal.start << ", length " << signal.length);
  });
}

TEST_CASE("A signal has the bits that a DBC gives it", "[unit]") {
  const Frame frame = *parse_frame("182#3702F0D8FFFF");  // statusword 0x0237, position -10000
  CHECK(decode({.name = "statusword", .start = 0, .length = 16}, frame) == 0x237);
  const Signal position{.name = "position",
                        .start = 16,
                        .length = 32,
                        .type = SignalType::kSigned,
                        .scale = 0.01,
                        .offset = 5,
                        .unit = "mm"};
  CHECK(*decode(position, frame) == Approx(-95));
  // The same number in Motorola's order begins at the most significant bit of its first byte.
  const Signal motorola{
      .name = "m", .start = 23, .length = 32, .order = ByteOrder::kMotorola, .type = SignalType::kSigned};
  CHECK(decode(motorola, *parse_frame("182#3702FFFFD8F0")) == -10000);
  const Signal middle{.name = "m", .start = 3, .length = 10, .order = ByteOrder::kMotorola};
  CHECK(decode(middle, *parse_frame("182#0AA8")) == 0b1010101010);
}

TEST_CASE("A signal may be a float of either width", "[unit]") {
  const Signal narrow{.name = "f", .start = 0, .length = 32, .type = SignalType::kFloat, .scale = 2};
  CHECK(decode(narrow, *parse_frame("009#000040C0")) == -6);
  CHECK_FALSE(decode(narrow, *parse_frame("009#0000C07F")));  // not a number
  const Signal wide{
      .name = "f", .start = 7, .length = 64, .order = ByteOrder::kMotorola, .type = SignalType::kFloat};
  CHECK(decode(wide, *parse_frame("009#3FF8000000000000")) == 1.5);
  Frame frame{.length = 8};
  CHECK(encode(wide, 0.1, frame));
  CHECK(decode(wide, frame) == 0.1);
  CHECK_FALSE(encode(narrow, 1e39, frame));
}

TEST_CASE("Every place of a signal in a frame holds the bits that a walk by DBC's numbering finds", "[law]") {
  std::mt19937_64 random(7);
  for_every_place([&](const Signal& signal) {
    Frame frame{.length = 8};
    for (uint8_t& byte : frame.data) byte = static_cast<uint8_t>(random());
    uint64_t expected = 0;
    for (int k = signal.length - 1; k >= 0; --k) expected = 2 * expected + bit_by_walking(signal, frame, k);
    const double value = *decode(signal, frame);
    if (value != static_cast<double>(expected))
      FAIL(signal.start << "|" << signal.length << " " << value << " " << expected);
  });
}

TEST_CASE("What is written into any place is read from it, and no other bit changes", "[law]") {
  std::mt19937_64 random(8);
  for_every_place([&](Signal signal) {
    for (const SignalType type : {SignalType::kUnsigned, SignalType::kSigned}) {
      signal.type = type;
      Frame frame{.length = 8};
      for (uint8_t& byte : frame.data) byte = static_cast<uint8_t>(random());
      const Frame before = frame;
      const int bits = std::min(signal.length, 53);
      double value = static_cast<double>(random() >> (64 - bits));
      if (type == SignalType::kSigned) value -= std::ldexp(1.0, bits - 1);
      if (!encode(signal, value, frame) || decode(signal, frame) != value)
        FAIL(signal.start << "|" << signal.length << " " << value);
      // Back to what was there: the frame is as before, bit by bit.
      if (signal.length > 53) continue;
      encode(signal, *decode(signal, before), frame);
      if (!(frame == before)) FAIL(signal.start << "|" << signal.length << " " << to_text(before));
    }
  });
}

TEST_CASE("A value that does not fit is not written, and none is read from a frame too short", "[unit]") {
  const Signal s{.name = "s", .start = 8, .length = 8, .type = SignalType::kSigned, .scale = 0.5};
  Frame frame = *parse_frame("100#1122");
  for (const double value : {64.0, -64.3, kNan, 1e300}) CHECK_FALSE(encode(s, value, frame));
  CHECK(to_text(frame) == "100#1122");
  CHECK(encode(s, 63.6, frame));
  CHECK(encode(s, -64, frame));
  CHECK(to_text(frame) == "100#1180");
  Frame shorter = *parse_frame("100#11");
  CHECK_FALSE(decode(s, shorter));
  CHECK_FALSE(encode(s, 0, shorter));
}

TEST_CASE("A signal that no frame can carry is refused with what is expected", "[unit]") {
  using Catch::Contains;
  const Signal good{.name = "s", .start = 0, .length = 8};
  CHECK_NOTHROW(check(good));
  const auto refused = [&](auto change) {
    Signal signal = good;
    change(signal);
    try {
      check(signal);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  CHECK_THAT(refused([](Signal& s) { s.name = "1st"; }), Contains("letters, digits and _"));
  CHECK_THAT(refused([](Signal& s) { s.start = 64; }), Contains("0..63"));
  CHECK_THAT(refused([](Signal& s) { s.length = 65; }), Contains("1..64"));
  CHECK_THAT(refused([](Signal& s) { s.start = 57; }), Contains("beyond the 8 bytes"));
  CHECK_THAT(refused([](Signal& s) { s.start = 56, s.length = 9, s.order = ByteOrder::kMotorola; }),
             Contains("beyond the 8 bytes"));
  CHECK_THAT(refused([](Signal& s) { s.type = SignalType::kFloat; }), Contains("32 or 64"));
  CHECK_THAT(refused([](Signal& s) { s.scale = 0; }), Contains("scale"));
  CHECK_THAT(refused([](Signal& s) { s.offset = kNan; }), Contains("offset"));
}

#ifndef TENDRIL_SANITIZED

TEST_CASE("A signal is read and written without a heap call", "[rt]") {
  const Signal signal{.name = "a_name_too_long_for_a_short_string", .start = 12, .length = 20};
  Frame frame{.length = 8};
  const uint64_t before = test::heap_calls();
  const bool fits = encode(signal, 123456, frame);
  const auto value = decode(signal, frame);
  CHECK(test::heap_calls() == before);
  CHECK(fits);
  CHECK(value == 123456);
}

#endif

}  // namespace tendril::hal::signal_test
