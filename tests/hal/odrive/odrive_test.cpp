// SPDX-License-Identifier: Apache-2.0
#include "hal/odrive/odrive.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

namespace tendril::hal::odrive_test {

TEST_CASE("An identifier is the node times 32 and the message", "[unit]") {
  CHECK(odrive_id(1, OdriveMessage::kSetInputPosition) == 0x2C);  // the example of the maker's page
  CHECK(odrive_id(0, OdriveMessage::kHeartbeat) == 0x001);
  CHECK(odrive_id(63, OdriveMessage::kClearErrors) == 0x7F8);
  CHECK(odrive_message(*parse_frame("02C#"), 1) == OdriveMessage::kSetInputPosition);
  CHECK_FALSE(odrive_message(*parse_frame("02C#"), 2));
  CHECK_FALSE(odrive_message(*parse_frame("0000002C#"), 1));  // 29 bits
  CHECK_FALSE(odrive_message(*parse_frame("03F#"), 1));       // a message that nobody here speaks
}

TEST_CASE("Orders to an axis have the bytes of CANSimple", "[unit]") {
  CHECK(to_text(encode_odrive_state(2, kOdriveClosedLoop)) == "047#08000000");
  CHECK(to_text(encode_odrive_mode(2, {})) == "04B#0300000001000000");
  CHECK(to_text(encode_odrive_clear_errors(2)) == "058#");
  CHECK(to_text(encode_odrive_limits(2, {20.0f, 10.0f})) == "04F#0000A04100002041");
  CHECK(to_text(encode_odrive_torque(2, 1.5f)) == "04E#0000C03F");
  CHECK(to_text(encode_odrive_input(2, {1.5f, 0.25f, -0.5f})) == "04C#0000C03FFA000CFE");
}

TEST_CASE("A feed-forward is rounded to a thousandth and kept within 16 bits", "[unit]") {
  CHECK(decode_odrive_input(encode_odrive_input(0, {0, 0.0126f, -0.0126f}), 0)->velocity == Approx(0.013));
  CHECK(decode_odrive_input(encode_odrive_input(0, {0, 0.0126f, -0.0126f}), 0)->torque == Approx(-0.013));
  CHECK(decode_odrive_input(encode_odrive_input(0, {0, 100, -100}), 0)->velocity == Approx(32.767));
  CHECK(decode_odrive_input(encode_odrive_input(0, {0, 100, -100}), 0)->torque == Approx(-32.767));
  CHECK(decode_odrive_input(encode_odrive_input(0, {0, std::nanf(""), 0}), 0)->velocity == 0);
}

TEST_CASE("A heartbeat has bytes of its own in each firmware family", "[unit]") {
  const OdriveHeartbeat old{
      .axis_error = 0x840, .state = 1, .component_errors = 1 | 4, .trajectory_done = true};
  CHECK(to_text(encode_odrive_heartbeat(3, OdriveFirmware::k0_5, old)) == "061#4008000001010081");
  const OdriveHeartbeat recent{
      .axis_error = 0x0100'0000, .state = 8, .procedure_result = kOdriveDisarmed, .trajectory_done = true};
  CHECK(to_text(encode_odrive_heartbeat(3, OdriveFirmware::k0_6, recent)) == "061#0000000108030100");

  const auto read = decode_odrive_heartbeat(*parse_frame("061#4008000001010081"), 3, OdriveFirmware::k0_5);
  REQUIRE(read);
  CHECK(read->axis_error == 0x840);
  CHECK(read->state == kOdriveIdle);
  CHECK(read->component_errors == (1 | 4));
  CHECK(read->procedure_result == 0);
  CHECK(read->trajectory_done);
  const auto other = decode_odrive_heartbeat(*parse_frame("061#0000000108030100"), 3, OdriveFirmware::k0_6);
  REQUIRE(other);
  CHECK(other->axis_error == 0x0100'0000);
  CHECK(other->state == kOdriveClosedLoop);
  CHECK(other->component_errors == 0);
  CHECK(other->procedure_result == kOdriveDisarmed);
  CHECK(other->trajectory_done);
}

TEST_CASE("What is encoded is read back, and only by its node", "[unit]") {
  const Frame estimates = encode_odrive_estimates(5, {-12.375f, 0.5f});
  CHECK(to_text(estimates) == "0A9#000046C10000003F");
  CHECK(decode_odrive_estimates(estimates, 5)->position == -12.375f);
  CHECK(decode_odrive_estimates(estimates, 5)->velocity == 0.5f);
  CHECK_FALSE(decode_odrive_estimates(estimates, 4));
  CHECK(decode_odrive_state(encode_odrive_state(5, 8), 5) == 8u);
  CHECK_FALSE(decode_odrive_state(encode_odrive_state(5, 8), 6));
  CHECK(decode_odrive_mode(encode_odrive_mode(5, {1, 2}), 5)->input == 2);
  CHECK(decode_odrive_limits(encode_odrive_limits(5, {1, 2}), 5)->current == 2);
  CHECK(decode_odrive_torque(encode_odrive_torque(5, -0.25f), 5) == -0.25f);
  CHECK_FALSE(decode_odrive_torque(encode_odrive_torque(5, 1), 6));
  CHECK_FALSE(decode_odrive_input(encode_odrive_limits(5, {1, 2}), 5));
}

TEST_CASE("A frame that is too short for its message is none", "[unit]") {
  CHECK_FALSE(decode_odrive_estimates(*parse_frame("0A9#"), 5));  // asks for them
  CHECK_FALSE(decode_odrive_estimates(*parse_frame("0A9#00000000000000"), 5));
  CHECK_FALSE(decode_odrive_heartbeat(*parse_frame("0A1#0000000001"), 5, OdriveFirmware::k0_6));
  CHECK_FALSE(decode_odrive_state(*parse_frame("0A7#080000"), 5));
  CHECK_FALSE(decode_odrive_input(*parse_frame("0AC#00000000"), 5));
}

TEST_CASE("Errors, states and results are told in words of their firmware", "[unit]") {
  CHECK(describe_odrive_error(OdriveFirmware::k0_5, 0x840) == "motor failed, watchdog timer expired");
  CHECK(describe_odrive_error(OdriveFirmware::k0_6, 0x0100'0008) ==
        "missing estimate, watchdog timer expired");
  CHECK(describe_odrive_error(OdriveFirmware::k0_6, 0x800) == "DC bus over-regeneration current");
  CHECK(describe_odrive_error(OdriveFirmware::k0_5, 0x8000'0001) == "invalid state, unknown bits 0x80000000");
  CHECK(describe_odrive_error(OdriveFirmware::k0_6, 0) == "no error");
  for (const OdriveFirmware firmware : {OdriveFirmware::k0_5, OdriveFirmware::k0_6}) {
    CHECK(describe_odrive_error(firmware, odrive_watchdog_error(firmware)) == "watchdog timer expired");
    CHECK(describe_odrive_error(firmware, odrive_estop_error(firmware)) == "emergency stop requested");
  }
  CHECK(describe_odrive_axis_state(kOdriveClosedLoop) == std::string("closed-loop control"));
  CHECK(describe_odrive_axis_state(14) == std::string("anticogging calibration"));
  CHECK(describe_odrive_axis_state(15) == std::string("a state without a name"));
  CHECK(describe_odrive_result(kOdriveNotCalibrated) == std::string("not calibrated"));
  CHECK(describe_odrive_result(16) == std::string("a result without a name"));
}

}  // namespace tendril::hal::odrive_test
