// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/sdo.h"

#include <catch2/catch.hpp>
#include <string>

namespace tendril::hal::sdo_test {

SdoRequest write(int index, int sub, int size, uint32_t value) {
  return {SdoRequest::Kind::kWrite, {static_cast<uint16_t>(index), static_cast<uint8_t>(sub)}, size, value};
}

TEST_CASE("Expedited SDO has the bytes of CiA 301", "[unit]") {
  CHECK(to_text(encode_sdo_request(2, write(0x6060, 0, 1, 8))) == "602#2F60600008000000");
  CHECK(to_text(encode_sdo_request(2, write(0x1017, 0, 2, 50))) == "602#2B17100032000000");
  CHECK(to_text(encode_sdo_request(2, write(0x1016, 1, 4, 0x007F0096))) == "602#2316100196007F00");
  CHECK(to_text(encode_sdo_request(2, {SdoRequest::Kind::kRead, {0x6061, 0}})) == "602#4061600000000000");
  CHECK(to_text(encode_sdo_answer(2, {SdoAnswer::Kind::kWritten, {0x6060, 0}})) == "582#6060600000000000");
  CHECK(to_text(encode_sdo_answer(2, {SdoAnswer::Kind::kValue, {0x6061, 0}, 1, 8})) ==
        "582#4F61600008000000");
  CHECK(to_text(encode_sdo_answer(2, {SdoAnswer::Kind::kValue, {0x1018, 1}, 4, 0xDEADBEEF})) ==
        "582#43181001EFBEADDE");
  CHECK(to_text(encode_sdo_answer(2, {SdoAnswer::Kind::kAbort, {0x60C2, 1}, 0, 0x06090030})) ==
        "582#80C2600130000906");
}

TEST_CASE("SDO transfers of every size read back, cut to their size", "[unit]") {
  for (int size = 0; size <= 4; ++size) {
    CAPTURE(size);
    const uint32_t all = 0x89ABCDEF, kept = size == 0 || size == 4 ? all : all & ((1u << 8 * size) - 1);
    const auto request = decode_sdo_request(encode_sdo_request(7, write(0x1234, 5, size, all)), 7);
    REQUIRE(request);
    CHECK(request->kind == SdoRequest::Kind::kWrite);
    CHECK(request->object == ObjectAddress{0x1234, 5});
    CHECK(request->size == size);
    CHECK(request->value == kept);
    const auto answer =
        decode_sdo_answer(encode_sdo_answer(7, {SdoAnswer::Kind::kValue, {0x1234, 5}, size, all}), 7);
    REQUIRE(answer);
    CHECK(answer->kind == SdoAnswer::Kind::kValue);
    CHECK(answer->size == size);
    CHECK(answer->value == kept);
  }
}

TEST_CASE("Segments of every length read back", "[unit]") {
  for (const bool toggle : {false, true}) {
    const auto request = decode_sdo_request(
        encode_sdo_request(
            7,
            {.kind = SdoRequest::Kind::kReadSegment, .object = {}, .size = 0, .value = 0, .toggle = toggle}),
        7);
    REQUIRE(request);
    CHECK(request->kind == SdoRequest::Kind::kReadSegment);
    CHECK(request->toggle == toggle);
    for (int size = 0; size <= 7; ++size) {
      SdoAnswer sent;
      sent.kind = SdoAnswer::Kind::kSegment;
      sent.size = size;
      sent.toggle = toggle;
      sent.last = size % 2 == 0;
      for (int i = 0; i < size; ++i) sent.segment[i] = static_cast<uint8_t>('a' + i);
      const auto answer = decode_sdo_answer(encode_sdo_answer(7, sent), 7);
      REQUIRE(answer);
      CHECK(answer->kind == SdoAnswer::Kind::kSegment);
      CHECK(answer->size == size);
      CHECK(answer->toggle == toggle);
      CHECK(answer->last == sent.last);
      CHECK(answer->segment == sent.segment);
    }
  }
  CHECK(to_text(encode_sdo_request(
            2,
            {.kind = SdoRequest::Kind::kReadSegment, .object = {}, .size = 0, .value = 0, .toggle = true})) ==
        "602#7000000000000000");
  const auto last = decode_sdo_answer(*parse_frame("582#1968656C00000000"), 2);
  CHECK(last->size == 3);
  CHECK(last->last);
  CHECK(last->toggle);
}

TEST_CASE("Segmented writes and block SDO transfers are recognised as not supported", "[unit]") {
  for (const char* text : {"602#2118100064000000", "602#0068656C6C6F0000", "602#C618100100000000"}) {
    CAPTURE(text);
    const auto request = decode_sdo_request(*parse_frame(text), 2);
    REQUIRE(request);
    CHECK(request->kind == SdoRequest::Kind::kOther);
  }
  CHECK(decode_sdo_answer(*parse_frame("582#C408100012000000"), 2)->kind == SdoAnswer::Kind::kOther);
  const auto announced = decode_sdo_answer(*parse_frame("582#4108100012000000"), 2);
  CHECK(announced->kind == SdoAnswer::Kind::kSegmented);
  CHECK(announced->value == 0x12);
}

TEST_CASE("An SDO abort code is told in words", "[unit]") {
  CHECK(std::string(describe_sdo_abort(0x06090030)) == "value not allowed");
  CHECK(std::string(describe_sdo_abort(0x12345678)) == "abort code of no known meaning");
}

}  // namespace tendril::hal::sdo_test
