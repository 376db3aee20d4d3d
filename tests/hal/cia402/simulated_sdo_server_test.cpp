// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/simulated_sdo_server.h"

#include <catch2/catch.hpp>

#include "tests/hal/cia402/simulated_drive_bench.h"

// The SDO server of a simulated drive, over its frames.

namespace tendril::hal::simulated_sdo_server_test {
using namespace tendril::hal::test;

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

TEST_CASE("A torque has two bytes, and its unit is no entry of a TPDO", "[unit]") {
  Bench bench;
  bench.advance(0);
  CHECK(bench.sdo("2B71600000FC0000") == "6071600000000000");
  CHECK(bench.sdo("4071600000000000") == "4B71600000FC0000");
  CHECK(bench.sdo("2371600000000000") == "8071600012000706");  // too long
  CHECK(bench.sdo("2376600001000000") == "8076600002000106");  // read only
  CHECK(bench.sdo("23001A0120007660") == "80001A0141000406");  // not mappable there
}

}  // namespace tendril::hal::simulated_sdo_server_test
