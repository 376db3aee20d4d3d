// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/frame.h"

#include <catch2/catch.hpp>

#include "hal/bus/frame_batch.h"

namespace tendril::hal::frame_test {

TEST_CASE("A frame reads back from its own text", "[unit]") {
  for (const char* text : {"202#0F0010270000", "080#", "7FF#00", "1FFFFFFF#0102030405060708", "00000123#AB",
                           "049#R", "00000049#R"}) {
    CAPTURE(text);
    const auto frame = parse_frame(text);
    REQUIRE(frame);
    CHECK(to_text(*frame) == text);
  }
  CHECK_FALSE(parse_frame("123#AB")->extended);
  CHECK(parse_frame("00000123#AB")->extended);
  CHECK(parse_frame("049#R")->remote);
  CHECK_FALSE(parse_frame("049#")->remote);
}

TEST_CASE("A frame of more than 8 bytes reads as one of CAN FD", "[unit]") {
  Frame frame{.id = 0x202, .length = 12};
  frame.data[11] = 0xAB;
  CHECK(to_text(frame) == "202##00000000000000000000000AB");
  frame.length = kMaxFrameBytes;
  CHECK(to_text(frame).size() == 6 + 2 * kMaxFrameBytes);
}

TEST_CASE("Text that is no frame is refused", "[unit]") {
  for (const char* text : {"", "202", "02#00", "800#00", "202#0", "202#0G", "202#010203040506070809",
                           "2 2#00", "20000000#00", "202##00", "202#-1", "0202#00", "202#RR", "202#R00"}) {
    CAPTURE(text);
    CHECK_FALSE(parse_frame(text));
  }
}

TEST_CASE("Frames are equal where they look the same on the wire", "[unit]") {
  Frame a = *parse_frame("123#0102");
  Frame b = a;
  b.data[7] = 9;  // past the length
  CHECK(a == b);
  b.data[1] = 9;
  CHECK_FALSE(a == b);
  b = a;
  b.extended = true;
  CHECK_FALSE(a == b);
  CHECK_FALSE(*parse_frame("123#R") == *parse_frame("123#"));
}

TEST_CASE("A full batch drops frames and counts them", "[unit]") {
  FrameBatch batch;
  for (int i = 0; i < FrameBatch::kCapacity; ++i) REQUIRE(batch.push({.id = static_cast<uint32_t>(i)}));
  CHECK_FALSE(batch.push({}));
  CHECK(batch.dropped() == 1);
  CHECK(batch.size() == FrameBatch::kCapacity);
  CHECK(batch[FrameBatch::kCapacity - 1].id == FrameBatch::kCapacity - 1);
  batch.clear();
  CHECK(batch.begin() == batch.end());
}

}  // namespace tendril::hal::frame_test
