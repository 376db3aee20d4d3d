// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/bus_budget.h"

#include <catch2/catch.hpp>

#include "hal/cia402/cia402_protocol.h"
#include "hal/drive/drive_protocol.h"
#include "hal/odrive/odrive_protocol.h"
#include "tests/hal/rig.h"

namespace tendril::hal::bus_budget_test {
using tendril::hal::test::camera;

TEST_CASE("Frames have their worst-case length with stuffing", "[unit]") {
  CHECK(worst_case_bits(Wire::kCan, 0) == 55);
  CHECK(worst_case_bits(Wire::kCan, 6) == 115);
  CHECK(worst_case_bits(Wire::kCan, 8) == 135);
  CHECK(worst_case_bits(Wire::kCan, 8, true) == 160);
}

TEST_CASE("Frames of CAN FD are counted with the length that they are filled up to", "[unit]") {
  // 22 + 96 bits and 29 stuff bits; stuff count and CRC with their fixed stuff bits; 13 to the next frame.
  CHECK(worst_case_bits(Wire::kCan, 12) == 22 + 96 + 29 + 27 + 13);
  CHECK(worst_case_bits(Wire::kCan, 64) == 22 + 512 + 133 + 32 + 13);
  CHECK(worst_case_bits(Wire::kCan, 64, true) == 41 + 512 + 138 + 32 + 13);
  for (const int filled : {12, 16, 20, 24, 32, 48, 64})
    CHECK(worst_case_bits(Wire::kCan, filled - 1) == worst_case_bits(Wire::kCan, filled));
}

TEST_CASE("A byte on a serial line has a start and a stop bit", "[unit]") {
  CHECK(worst_case_bits(Wire::kSerial, 14) == 140);
}

TEST_CASE("The load of cyclic drives is that of the table", "[unit]") {
  const auto percent = [](int axes, double rate_hz) {
    const PeriodicFrames traffic[] = {{.length = 0, .rate_hz = rate_hz},
                                      {.length = 6, .rate_hz = rate_hz, .count = 2 * axes}};
    return 100 * bus_load(Wire::kCan, traffic, 1e6);
  };
  CHECK(percent(4, 500) == Approx(48.75));
  CHECK(percent(4, 600) == Approx(58.5));
  CHECK(percent(4, 1000) == Approx(97.5));
  CHECK(percent(8, 500) == Approx(94.75));
}

TEST_CASE("A load is judged before it can hurt", "[unit]") {
  const auto verdict = [](double load) {
    const PeriodicFrames traffic[] = {{.length = 8, .rate_hz = load * 1e6 / 135}};
    return judge_bus(Wire::kCan, traffic, 1e6).verdict;
  };
  CHECK(verdict(0.69) == BusBudget::Verdict::kFits);
  CHECK(verdict(0.71) == BusBudget::Verdict::kTight);
  CHECK(verdict(1.01) == BusBudget::Verdict::kExceeds);
  const PeriodicFrames much[] = {{.length = 8, .rate_hz = 10'000}};
  CHECK_THAT(judge_bus(Wire::kCan, much, 1e6).text,
             Catch::Contains("135 %") && Catch::Contains("lower the control rate"));
}

TEST_CASE("The budget of a robot counts PDOs, SYNC, heartbeats and sensors", "[unit]") {
  MasterConfig config{
      .protocol = &cia402_protocol(), .axes = std::vector<AxisConfig>(4), .period_ns = 1'666'667};
  config.sensors = {camera(0x1F0)};
  // 58.5 % as above, 5 heartbeats of 65 bits at 20 Hz, a camera of 135 bits at 100 Hz.
  CHECK(bus_load(Wire::kCan, periodic_frames(config), 1e6) == Approx(0.585 + 0.0065 + 0.0135).epsilon(1e-4));
  config.sensors[0].extended = true;  // 160 bits
  CHECK(bus_load(Wire::kCan, periodic_frames(config), 1e6) == Approx(0.585 + 0.0065 + 0.0160).epsilon(1e-4));
}

TEST_CASE("Set-points that are torques are shorter, and the budget knows it", "[unit]") {
  using namespace tendril::hal::test;
  const auto saved = [](const MasterConfig& config) {
    return bus_load(Wire::kCan, periodic_frames(config), 1e6) -
           bus_load(Wire::kCan, periodic_frames(on_efforts(config, 3, 1e-2)), 1e6);
  };
  const double rate_hz = 1e9 / kPeriod_ns;
  CHECK(saved(config_of(4)) == Approx(3 * rate_hz * (115 - 95) / 1e6));
  CHECK(saved(odrive_config_of(4)) == Approx(3 * rate_hz * (135 - 95) / 1e6));
}

TEST_CASE("The budget of ODrive axes counts inputs, estimates, heartbeats and sensors", "[unit]") {
  MasterConfig config{
      .protocol = &odrive_protocol(), .axes = std::vector<AxisConfig>(4), .period_ns = 2'000'000};
  config.heartbeat_ns = 100'000'000;
  odrive_settings(config).encoder_period_ns = 2'000'000;
  // 4 axes at 500 Hz each way, 8 bytes: 54 % by the worst-case bits; heartbeats of 135 bits at 10 Hz.
  CHECK(bus_load(Wire::kCan, periodic_frames(config), 1e6) == Approx(0.54 + 0.0054).epsilon(1e-6));
  odrive_settings(config).encoder_period_ns = 10'000'000;
  config.sensors = {camera(0x7F0)};
  CHECK(bus_load(Wire::kCan, periodic_frames(config), 1e6) ==
        Approx(0.27 + 0.054 + 0.0054 + 0.0135).epsilon(1e-6));
}

}  // namespace tendril::hal::bus_budget_test
