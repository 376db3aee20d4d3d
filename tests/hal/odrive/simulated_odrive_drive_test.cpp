// SPDX-License-Identifier: Apache-2.0
#include "hal/odrive/simulated_odrive_drive.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "hal/sensor/signal.h"

namespace tendril::hal::simulated_odrive_drive_test {

constexpr int64_t kMillisecond_ns = 1'000'000;
constexpr double kRunUp_s =
    1 / (4 * kOdrivePositionGain) + 1e-3;  // that the velocity loop takes to top speed

/// An axis, node 2, that is talked to frame by frame.
struct Bench {
  explicit Bench(SimulatedOdriveSpec spec = {}) : drive(at_node_2(spec)) { advance(0); }

  static SimulatedOdriveSpec at_node_2(SimulatedOdriveSpec spec) {
    spec.node = 2;
    return spec;
  }

  std::vector<std::string> say(const Frame& frame) {
    FrameBatch out;
    drive.receive(frame, now_ns, out);
    return texts(out);
  }

  std::vector<std::string> advance(int64_t duration_ns) {
    FrameBatch out;
    now_ns += duration_ns;
    drive.advance(now_ns, out);
    return texts(out);
  }

  /// Advances in steps and says how often frames of that identifier came.
  int count(const std::string& id, int64_t duration_ns) {
    int number = 0;
    for (const int64_t end_ns = now_ns + duration_ns; now_ns < end_ns;)
      for (const std::string& text : advance(kMillisecond_ns)) number += text.starts_with(id) ? 1 : 0;
    return number;
  }

  void close() {
    say(encode_odrive_mode(2, {}));
    say(encode_odrive_state(2, kOdriveClosedLoop));
  }

  static std::vector<std::string> texts(const FrameBatch& batch) {
    std::vector<std::string> list;
    for (const Frame& frame : batch) list.push_back(to_text(frame));
    return list;
  }

  SimulatedOdriveDrive drive;
  int64_t now_ns = 0;
};

TEST_CASE("An axis tells its position every 10 ms and that it lives every 100 ms", "[unit]") {
  Bench bench;
  CHECK(bench.count("049#", 1'000 * kMillisecond_ns) == 100);
  CHECK(bench.count("041#", 1'000 * kMillisecond_ns) == 10);
  Bench fast({.encoder_period_ns = 2 * kMillisecond_ns});
  CHECK(fast.count("049#", 1'000 * kMillisecond_ns) == 500);
}

TEST_CASE("A remote frame, or an empty one, asks for the position", "[unit]") {
  Bench bench({.firmware = GENERATE(OdriveFirmware::k0_5, OdriveFirmware::k0_6), .position = 1.5});
  for (const char* question : {"049#R", "049#"})
    CHECK(bench.say(*parse_frame(question)) == std::vector<std::string>{"049#0000C03F00000000"});
  CHECK(bench.say(*parse_frame("069#R")).empty());                 // another node
  CHECK(bench.say(*parse_frame("00000049#R")).empty());            // 29 bits
  CHECK(bench.say(*parse_frame("049#0000000000000000")).empty());  // nobody's question
}

TEST_CASE("An axis is delivered in position control with the input passed through", "[unit]") {
  Bench bench;
  bench.say(encode_odrive_state(2, kOdriveClosedLoop));
  bench.say(encode_odrive_input(2, {.position = 1}));
  bench.advance(2'000 * kMillisecond_ns);
  CHECK(bench.drive.position() == Approx(1));
}

TEST_CASE("An axis of firmware 0.6 tells its version, its errors and what ended its control", "[unit]") {
  Bench bench;
  const auto answer = [&](const char* question) {
    const auto answers = bench.say(*parse_frame(question));
    return answers.size() == 1 ? answers[0] : "";
  };
  CHECK(answer("040#R") == "040#0200000000060000");
  CHECK(answer("041#R") == "041#0000000001000000");
  CHECK(answer("043#R") == "043#0000000000000000");
  bench.drive.inject_fault(0x100);  // while idle: it ends nothing
  CHECK(answer("043#R") == "043#0001000000000000");
  bench.say(encode_odrive_clear_errors(2));
  bench.close();
  bench.drive.overheat();
  CHECK(answer("043#R") == "043#0040000000400000");
  CHECK(answer("055#R") == "055#0000F2420000C841");  // 121 and 25 °C
  bench.drive.inject_fault(0x100);
  CHECK(answer("043#R") == "043#0041000000400000");
  bench.say(encode_odrive_clear_errors(2));
  CHECK(answer("043#R") == "043#0000000000000000");
  CHECK(answer("055#R") == "055#0000C8410000C841");
}

TEST_CASE("What firmware 0.5 has other messages for is not answered in it", "[unit]") {
  Bench bench({.firmware = OdriveFirmware::k0_5});
  for (const char* question : {"040#R", "041#R", "043#R", "055#R"})
    CHECK(bench.say(*parse_frame(question)).empty());
}

TEST_CASE("Of all messages, a question is answered by those that an axis tells, once, and no other",
          "[unit]") {
  struct Row {
    OdriveFirmware firmware;
    std::vector<uint32_t> told;
  };
  const Row row = GENERATE(Row{OdriveFirmware::k0_5, {0x09, 0x14, 0x17}},
                           Row{OdriveFirmware::k0_6, {0x00, 0x01, 0x03, 0x09, 0x14, 0x15, 0x17}});
  const bool remote = GENERATE(true, false);  // or empty
  for (uint32_t message = 0; message < 32; ++message) {
    CAPTURE(message, remote);
    Bench bench({.firmware = row.firmware, .position = 1});
    bench.close();
    const auto answers = bench.say({.id = 2u << 5 | message, .remote = remote});
    const bool told = std::ranges::count(row.told, message) == 1;
    REQUIRE(answers.size() == (told ? 1 : 0));
    if (told) CHECK(parse_frame(answers[0])->id == (2u << 5 | message));
    // Firmware 0.5 takes any frame for the order to stop or to clear errors. Without data nothing is set.
    const bool stops = message == static_cast<uint32_t>(OdriveMessage::kEstop);
    CHECK(bench.drive.axis_error() == (stops ? odrive_estop_error(row.firmware) : 0));
    CHECK(bench.drive.state() == (stops ? kOdriveIdle : kOdriveClosedLoop));
    bench.advance(1'000 * kMillisecond_ns);
    CHECK(bench.drive.position() == Approx(1));
  }
}

TEST_CASE("An axis draws the current that holds its load and the power that moves it", "[unit]") {
  Bench bench({.firmware = GENERATE(OdriveFirmware::k0_5, OdriveFirmware::k0_6),
               .top_speed = 10,
               .torque_limit = 2,
               .torque_constant = 0.05,
               .supply_voltage = 48});
  const auto told = [&](const char* question) {
    const auto answers = bench.say(*parse_frame(question));
    REQUIRE(answers.size() == 1);
    const auto value = [&](int start) {
      return *decode({.name = "", .start = start, .length = 32, .type = SignalType::kFloat},
                     *parse_frame(answers[0]));
    };
    return std::pair(value(0), value(32));
  };
  bench.drive.set_load(0.25);
  CHECK(told("054#R") == std::pair(0.0, 0.0));
  CHECK(told("057#R") == std::pair(48.0, 0.0));
  bench.close();
  CHECK(told("054#R") == std::pair(10.0, 10.0));
  for (int k = 1; k <= 200; ++k) {
    bench.say(encode_odrive_input(2, {.position = 3e-3f * static_cast<float>(k), .velocity = 3}));
    bench.advance(kMillisecond_ns);
  }
  CHECK(told("057#R").second == Approx(2 * std::numbers::pi * 3 * 0.5 / 48).epsilon(0.01));
  bench.drive.set_load(-0.25);
  CHECK(told("054#R").second == Approx(-10));
  CHECK(told("057#R").second < 0);  // the load drives it
}

TEST_CASE("An axis in closed-loop control follows its input with the speed that it has", "[unit]") {
  Bench bench({.top_speed = 2, .position = 1});
  bench.close();
  CHECK(bench.drive.power_stage() == PowerStage::kOn);
  bench.say(encode_odrive_input(2, {.position = 5}));
  bench.advance(500 * kMillisecond_ns);
  CHECK(bench.drive.position() == Approx(2.0).margin(2 * kRunUp_s));  // at top speed
  bench.advance(2'000 * kMillisecond_ns);
  CHECK(bench.drive.position() == Approx(5.0));
  bench.say(encode_odrive_limits(2, {.velocity = 0.5f, .current = 10}));
  bench.say(encode_odrive_input(2, {.position = 0}));
  bench.advance(1'000 * kMillisecond_ns);
  CHECK(bench.drive.position() == Approx(4.5).margin(0.5 * kRunUp_s));
}

TEST_CASE("An axis tells its position in steps of its encoder", "[unit]") {
  Bench bench({.top_speed = 2, .position = 0.3, .encoder_counts = 1000});
  bench.close();
  bench.say(encode_odrive_input(2, {.position = 0.7f}));
  for (int k = 0; k < 50; ++k) {
    bench.advance(3 * kMillisecond_ns);
    const auto told = decode_odrive_estimates(*parse_frame(bench.say(*parse_frame("049#")).back()), 2);
    REQUIRE(told);
    CHECK(told->position == Approx(bench.drive.position()).margin(0.5001e-3));
    CHECK(1e3f * told->position == Approx(std::round(1e3 * told->position)).margin(1e-4));
  }
}

TEST_CASE("A load beyond its force limit drags an axis in closed-loop control, and no other", "[unit]") {
  Bench bench({.top_speed = 2, .position = 1});
  bench.drive.set_load(1.5);
  bench.advance(100 * kMillisecond_ns);
  CHECK(bench.drive.position() == 1.0);
  bench.close();
  bench.advance(100 * kMillisecond_ns);
  CHECK(bench.drive.position() < 0.95);
  bench.drive.set_load(0.9);
  bench.advance(2'000 * kMillisecond_ns);
  CHECK(bench.drive.position() == Approx(1.0));
}

TEST_CASE("An input that is no number is not followed, nor any with a speed limit below 0", "[unit]") {
  Bench bench({.position = 1});
  bench.close();
  bench.say(encode_odrive_limits(2, {.velocity = -1, .current = 10}));
  bench.say(encode_odrive_input(2, {.position = 2}));
  bench.advance(100 * kMillisecond_ns);
  CHECK(bench.drive.position() == 1.0);
  bench.say(encode_odrive_limits(2, {.velocity = 1, .current = 10}));
  bench.say(encode_odrive_input(2, {.position = 1}));
  bench.say(encode_odrive_input(2, {.position = std::nanf("")}));
  bench.advance(100 * kMillisecond_ns);
  CHECK(bench.drive.position() == 1.0);
}

TEST_CASE("In torque control an axis turns until its load equals the input torque, within its limit",
          "[unit]") {
  const auto [torque, balance] = GENERATE(table<double, double>({{0.5, 0.5}, {-0.2, -0.2}, {5, 2}}));
  CAPTURE(torque);
  Bench bench({.top_speed = 2, .tuning = {.position_gain = 20, .friction = 0.2}, .torque_limit = 2});
  bench.say(encode_odrive_mode(2, {.control = kOdriveTorqueControl}));
  bench.say(encode_odrive_state(2, kOdriveClosedLoop));
  bench.advance(100 * kMillisecond_ns);
  CHECK(bench.drive.position() == 0);
  bench.say(encode_odrive_torque(2, static_cast<float>(torque)));
  constexpr double kSpring_Nm = 4;  // a turn
  for (int k = 0; k < 300; ++k) {
    bench.drive.set_load(kSpring_Nm * bench.drive.position() / 2);
    bench.advance(10 * kMillisecond_ns);
  }
  CHECK(kSpring_Nm * bench.drive.position() == Approx(balance).epsilon(1e-3));
  bench.say(encode_odrive_mode(2, {}));  // and back to position control, where the input waits
  bench.drive.set_load(0);
  bench.advance(2'000 * kMillisecond_ns);
  CHECK(bench.drive.position() == Approx(0).margin(1e-6));
}

TEST_CASE("A jammed axis stays where it is and says nothing of it, until it is let go", "[unit]") {
  Bench bench({.position = 1});
  bench.close();
  bench.say(encode_odrive_input(2, {.position = 5}));
  bench.drive.set_jammed(true);
  bench.advance(2'000 * kMillisecond_ns);
  CHECK(bench.drive.position() == 1.0);
  CHECK(bench.drive.power_stage() == PowerStage::kOn);
  bench.drive.set_jammed(false);
  bench.advance(2'000 * kMillisecond_ns);
  CHECK(bench.drive.position() == Approx(5.0));
}

TEST_CASE("Without the velocity an axis lags behind a moving input, with it it does not", "[unit]") {
  for (const bool told : {false, true}) {
    Bench bench;
    bench.close();
    const double speed = 0.5;  // rev/s
    for (int k = 1; k <= 1000; ++k) {
      bench.say(encode_odrive_input(2, {.position = static_cast<float>(speed * k * 1e-3),
                                        .velocity = told ? static_cast<float>(speed) : 0}));
      bench.advance(kMillisecond_ns);
    }
    CHECK(speed - bench.drive.position() == Approx(told ? 0 : speed / 20).margin(1e-3));
  }
}

TEST_CASE("The winch locks itself outside closed-loop control, and in modes that are none of ours",
          "[unit]") {
  Bench bench({.position = 1});
  bench.say(encode_odrive_mode(2, {}));
  bench.say(encode_odrive_input(2, {.position = 5}));
  bench.advance(1'000 * kMillisecond_ns);
  CHECK(bench.drive.position() == 1.0);
  Bench other({.position = 1});
  other.say(encode_odrive_mode(2, {.control = 1}));  // torque
  other.say(encode_odrive_state(2, kOdriveClosedLoop));
  other.say(encode_odrive_input(2, {.position = 5}));
  other.advance(1'000 * kMillisecond_ns);
  CHECK(other.drive.position() == 1.0);
}

TEST_CASE("The watchdog goes off where no frame comes, whatever frame feeds it", "[unit]") {
  const OdriveFirmware firmware = GENERATE(OdriveFirmware::k0_5, OdriveFirmware::k0_6);
  Bench bench({.firmware = firmware, .watchdog_ns = 100 * kMillisecond_ns});
  bench.close();
  for (int k = 0; k < 20; ++k) {
    bench.say(*parse_frame(k % 2 ? "05F#" : "04C#"));  // unknown, too short: they feed all the same
    bench.advance(50 * kMillisecond_ns);
  }
  CHECK(bench.drive.power_stage() == PowerStage::kOn);
  bench.advance(100 * kMillisecond_ns);
  CHECK(bench.drive.axis_error() == odrive_watchdog_error(firmware));
  CHECK(bench.drive.state() == kOdriveIdle);
  CHECK(bench.drive.power_stage() == PowerStage::kFault);

  bench.say(encode_odrive_state(2, kOdriveClosedLoop));
  CHECK(bench.drive.state() == kOdriveIdle);  // refused with an error pending
  bench.say(encode_odrive_clear_errors(2));
  CHECK(bench.drive.axis_error() == 0);
  bench.say(encode_odrive_state(2, kOdriveClosedLoop));
  CHECK(bench.drive.state() == kOdriveClosedLoop);
}

TEST_CASE("A frame to another node feeds no watchdog", "[unit]") {
  Bench bench({.watchdog_ns = 100 * kMillisecond_ns});
  for (int k = 0; k < 20; ++k) {
    bench.say(*parse_frame("02C#0000000000000000"));
    bench.advance(10 * kMillisecond_ns);
  }
  CHECK(bench.drive.power_stage() == PowerStage::kFault);
}

TEST_CASE("An axis without calibration refuses closed-loop control and says why", "[unit]") {
  Bench recent({.calibrated = false});
  recent.close();
  CHECK(recent.drive.state() == kOdriveIdle);
  CHECK(recent.drive.axis_error() == 0);
  CHECK(recent.advance(100 * kMillisecond_ns).back() == "041#00000000010E0000");  // 14, not calibrated
  Bench old({.firmware = OdriveFirmware::k0_5, .calibrated = false});
  old.close();
  CHECK(old.drive.state() == kOdriveIdle);
  CHECK(old.advance(100 * kMillisecond_ns).back() == "041#0100000001000000");  // invalid state
}

TEST_CASE("An emergency stop, heat and an unplugged motor disarm, each in its own way", "[unit]") {
  Bench stopped;
  stopped.close();
  stopped.say(*parse_frame("042#"));
  CHECK(stopped.drive.axis_error() == odrive_estop_error(OdriveFirmware::k0_6));
  CHECK(stopped.drive.state() == kOdriveIdle);
  Bench hot({.firmware = OdriveFirmware::k0_5});
  hot.close();
  hot.drive.overheat();
  CHECK(hot.drive.axis_error() == kOdriveOverTemperature_0_5);
  CHECK(hot.drive.power_stage() == PowerStage::kFault);
  Bench unplugged({.firmware = OdriveFirmware::k0_5});
  unplugged.close();
  unplugged.drive.unplug_motor();
  CHECK(unplugged.advance(100 * kMillisecond_ns).back() == "041#0000000001010000");  // error 0, idle
}

TEST_CASE("States other than idle and closed-loop control are refused", "[unit]") {
  Bench bench;
  bench.close();
  bench.say(encode_odrive_state(2, 3));
  CHECK(bench.drive.state() == kOdriveIdle);
  CHECK(bench.advance(100 * kMillisecond_ns).back() == "041#00000000010D0000");  // 13, invalid state
}

}  // namespace tendril::hal::simulated_odrive_drive_test
