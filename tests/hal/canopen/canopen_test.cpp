// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/canopen.h"

#include <catch2/catch.hpp>
#include <string>

#include "hal/canopen/emergency.h"

namespace tendril::hal::canopen_test {

TEST_CASE("NMT, SYNC, heartbeat and EMCY have the bytes of CiA 301", "[unit]") {
  CHECK(to_text(encode_nmt({NmtCommand::kStart, 2})) == "000#0102");
  CHECK(to_text(encode_nmt({NmtCommand::kPreOperational, 0})) == "000#8000");
  CHECK(to_text(encode_nmt({NmtCommand::kResetCommunication, 127})) == "000#827F");
  CHECK(to_text(encode_sync()) == "080#");
  CHECK(to_text(encode_heartbeat(2, NmtState::kBootUp)) == "702#00");
  CHECK(to_text(encode_heartbeat(127, NmtState::kOperational)) == "77F#05");
  CHECK(to_text(encode_emergency(2, {0x8130, 0x11, {1, 2, 3, 4, 5}})) == "082#3081110102030405");
}

TEST_CASE("NMT orders, heartbeats and emergencies read back", "[unit]") {
  const auto order = decode_nmt(*parse_frame("000#8105"));
  REQUIRE(order);
  CHECK(order->command == NmtCommand::kResetNode);
  CHECK(order->node == 5);
  CHECK_FALSE(decode_nmt(*parse_frame("000#0305")));    // no such command
  CHECK_FALSE(decode_nmt(*parse_frame("000#010500")));  // too long
  CHECK(decode_heartbeat(*parse_frame("705#7F"), 5) == NmtState::kPreOperational);
  CHECK_FALSE(decode_heartbeat(*parse_frame("705#7F"), 4));
  CHECK_FALSE(decode_heartbeat(*parse_frame("00000705#7F"), 5));  // 29-bit identifier
  const auto emergency = decode_emergency(encode_emergency(3, {0x2310, 2, {9, 8, 7, 6, 5}}), 3);
  REQUIRE(emergency);
  CHECK(emergency->code == 0x2310);
  CHECK(emergency->error_register == 2);
  CHECK(emergency->detail == std::array<uint8_t, 5>{9, 8, 7, 6, 5});
  CHECK_FALSE(decode_emergency(encode_sync(), 0));  // SYNC is no EMCY of node 0: it has no data
}

TEST_CASE("An EMCY error code is told in words, or its class is", "[unit]") {
  CHECK(std::string(describe_emergency(0x8130)) == "heartbeat of the master lost");
  CHECK(std::string(describe_emergency(0x4310)) == "drive too hot");
  CHECK(std::string(describe_emergency(0x2310)) == "continuous overcurrent at the output");
  CHECK(std::string(describe_emergency(0x23FF)) == "current on the output side");
  CHECK(std::string(describe_emergency(0x3220)) == "undervoltage of the DC link");
  CHECK(std::string(describe_emergency(0x8250)) == "time-out of an RPDO");
}

}  // namespace tendril::hal::canopen_test
