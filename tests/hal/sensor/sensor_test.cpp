// SPDX-License-Identifier: Apache-2.0
#include "hal/sensor/sensor.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "hal/sensor/sensor_bank.h"
#include "tests/hal/heap_count.h"
#include "tests/hal/rig.h"

namespace tendril::hal::sensor_test {
using namespace tendril::hal::test;

constexpr int64_t kMillisecond_ns = 1'000'000;
constexpr int64_t kStart_ns = 1'000 * kMillisecond_ns;  // stamps of zero mean "never"
constexpr int64_t kStartTimeout_ns = 500 * kMillisecond_ns;

/// Amplifiers of two load cells: floats in N, big end first, without an age.
SensorConfig load_cells() {
  const auto tension = [](const char* name, int start) {
    return Signal{.name = name,
                  .start = start,
                  .length = 32,
                  .order = ByteOrder::kMotorola,
                  .type = SignalType::kFloat,
                  .scale = 2,
                  .offset = 1,
                  .unit = "N"};
  };
  return {.name = "cells",
          .id = 0x2A0,
          .timeout_ns = 30 * kMillisecond_ns,
          .signals = {tension("north_tension", 7), tension("south_tension", 39)}};
}

Frame sample(const SensorConfig& sensor, std::vector<double> values, int64_t age_ns = 0) {
  const auto frame = encode_sample(sensor, values, age_ns);
  REQUIRE(frame);
  return *frame;
}

/// A bank that is asked once a period, as a master does.
struct Listening {
  explicit Listening(std::vector<SensorConfig> sensors)
      : configs(std::move(sensors)), bank(configs, kStartTimeout_ns) {}

  const SensorReadings& after(int64_t duration_ns) {
    for (const int64_t end_ns = now_ns + duration_ns; now_ns < end_ns; now_ns += kMillisecond_ns)
      readings = &bank.judge(now_ns);
    return *readings;
  }

  std::vector<SensorConfig> configs;
  SensorBank bank;
  int64_t now_ns = kStart_ns;
  const SensorReadings* readings = nullptr;
};

TEST_CASE("A sample has the bytes that its sensor's description says", "[unit]") {
  CHECK(to_text(sample(camera(0x1F0), {0.01, -0.01, 0.125}, 2'500'000)) == "1F0#E80318FCD430FA00");
  CHECK(to_text(sample(load_cells(), {3, 0})) == "2A0#3F800000BF000000");
  SensorConfig padded = load_cells();
  padded.signals.pop_back();
  CHECK(to_text(sample(padded, {3})) == "2A0#3F80000000000000");
  padded.length = 4;
  CHECK(to_text(sample(padded, {3})) == "2A0#3F800000");
}

TEST_CASE("There is no sample where a value or the age does not fit", "[unit]") {
  const auto fits = [](double x, int64_t age_ns) {
    const double values[] = {x, 0, 0};
    return encode_sample(camera(0x1F0), values, age_ns).has_value();
  };
  CHECK(fits(-0.32768, 655'350'000));
  CHECK_FALSE(fits(0.33, 0));
  CHECK_FALSE(fits(std::numeric_limits<double>::quiet_NaN(), 0));
  CHECK_FALSE(fits(0, 656 * kMillisecond_ns));
}

TEST_CASE("Each signal of each sensor is read into its place", "[unit]") {
  Listening listening({camera(0x1F0), load_cells()});
  CHECK(listening.bank.identifiers() == std::vector<uint32_t>{0x1F0, 0x2A0});
  CHECK(listening.bank.receive(sample(listening.configs[1], {3, 0.5}), kStart_ns));
  CHECK(listening.bank.receive(sample(listening.configs[0], {0.01, 0.02, 0.125}, 5'000'000), kStart_ns));
  const SensorReadings& readings = listening.after(kMillisecond_ns);
  const double expected[] = {0.01, 0.02, 0.125, 3, 0.5};
  for (int k = 0; k < 5; ++k) CHECK(readings.value[k] == Approx(expected[k]));
  CHECK(readings.stamp_ns[0] == kStart_ns - 5 * kMillisecond_ns);
  CHECK(readings.stamp_ns[1] == kStart_ns);
}

TEST_CASE("A sample is fresh until its age, the told one included, is above the timeout", "[unit]") {
  Listening listening({camera(0x1F0), load_cells()});
  CHECK_FALSE(listening.after(kMillisecond_ns).fresh[0]);
  listening.bank.receive(sample(listening.configs[0], {0, 0, 0}, 60 * kMillisecond_ns), listening.now_ns);
  listening.bank.receive(sample(listening.configs[1], {0, 0}), listening.now_ns);
  CHECK(listening.after(31 * kMillisecond_ns).fresh[1]);
  CHECK_FALSE(listening.after(1 * kMillisecond_ns).fresh[1]);
  CHECK(listening.after(9 * kMillisecond_ns).fresh[0]);
  CHECK_FALSE(listening.after(1 * kMillisecond_ns).fresh[0]);
  listening.bank.receive(sample(listening.configs[0], {0, 0, 0}, 101 * kMillisecond_ns), listening.now_ns);
  CHECK_FALSE(listening.after(1 * kMillisecond_ns).fresh[0]);  // it came late
}

TEST_CASE("A measurement is never younger than its arrival", "[unit]") {
  SensorConfig hasty = camera(0x1F0);
  hasty.age->type = SignalType::kSigned;
  Listening listening({hasty});
  listening.bank.receive(sample(hasty, {0, 0, 0}, -50 * kMillisecond_ns), kStart_ns);
  CHECK(listening.after(kMillisecond_ns).stamp_ns[0] == kStart_ns);
}

TEST_CASE("What is no sample of a sensor changes nothing", "[unit]") {
  Listening listening({camera(0x1F0), load_cells()});
  listening.bank.receive(sample(listening.configs[1], {3, 4}), kStart_ns);
  for (const char* text : {"1F0#00000000000000", "2A0#3F8000007FC00000", "2A0#7F80000000000000"})
    CHECK(listening.bank.receive(*parse_frame(text), kStart_ns + 1));
  CHECK_FALSE(listening.bank.receive(*parse_frame("000002A0#0000000000000000"), kStart_ns + 1));
  CHECK_FALSE(listening.bank.receive(*parse_frame("2A1#0000000000000000"), kStart_ns + 1));
  const SensorReadings& readings = listening.after(kMillisecond_ns);
  CHECK(readings.stamp_ns[0] == 0);
  CHECK(readings.stamp_ns[1] == kStart_ns);
  CHECK(readings.value[3] == 3);
  CHECK(readings.value[4] == 4);
}

TEST_CASE("A sensor is told from another by the format of its identifier too", "[unit]") {
  SensorConfig plain = load_cells(), extended = load_cells();
  extended.extended = true;
  Listening listening({plain, extended});
  CHECK(listening.bank.identifiers() == std::vector<uint32_t>{0x2A0, 0x8000'02A0});
  CHECK(to_text(sample(extended, {3, 4})).starts_with("000002A0#"));
  listening.bank.receive(sample(extended, {3, 4}), kStart_ns);
  const SensorReadings& readings = listening.after(kMillisecond_ns);
  CHECK(readings.stamp_ns[0] == 0);
  CHECK(readings.stamp_ns[1] == kStart_ns);
  CHECK(readings.value[3] == 4);
}

TEST_CASE("A required sensor has the time of a start to be heard, then its timeout from sample to sample",
          "[unit]") {
  SensorConfig cells = load_cells();
  cells.required = true;
  Listening listening({camera(0x1F0), cells});  // the camera is never heard, and nobody minds
  CHECK_FALSE(listening.after(kStartTimeout_ns + kMillisecond_ns).ready);
  CHECK(listening.readings->lost == -1);
  CHECK(listening.after(kMillisecond_ns).lost == 1);
  listening.bank.receive(sample(cells, {0, 0}), listening.now_ns);
  CHECK(listening.after(31 * kMillisecond_ns).ready);
  CHECK(listening.readings->lost == -1);
  CHECK(listening.after(kMillisecond_ns).lost == 1);
  CHECK_FALSE(listening.readings->ready);
}

TEST_CASE("A pause of the listener is no loss of a sensor, but silence after it is", "[unit]") {
  SensorConfig cells = load_cells();
  cells.required = true;
  Listening listening({cells});
  listening.bank.receive(sample(cells, {0, 0}), listening.now_ns);
  listening.after(10 * kMillisecond_ns);
  listening.now_ns += 200 * kMillisecond_ns;
  CHECK(listening.after(30 * kMillisecond_ns).lost == -1);
  CHECK_FALSE(listening.readings->fresh[0]);
  CHECK(listening.after(2 * kMillisecond_ns).lost == 0);
}

TEST_CASE("Each unsound description of a sensor is refused with its reason", "[unit]") {
  const auto refused = [](const std::string& words, auto spoil) {
    std::vector<SensorConfig> sensors = {camera(0x1F0), load_cells()};
    CHECK_NOTHROW(check(sensors));
    spoil(sensors);
    CHECK_THROWS_WITH(check(sensors), Catch::Contains(words));
  };
  using Sensors = std::vector<SensorConfig>;
  refused("'cells': the identifier", [](Sensors& s) { s[1].id = 0x800; });
  refused("must fit 29 bits", [](Sensors& s) { s[1].id = 0x2000'0000, s[1].extended = true; });
  refused("1..8 bytes", [](Sensors& s) { s[1].length = 9; });
  refused("'south_tension' reaches beyond the frame's", [](Sensors& s) { s[1].length = 7; });
  refused("rate", [](Sensors& s) { s[0].rate_hz = 0; });
  refused("timeout", [](Sensors& s) { s[0].timeout_ns = 0; });
  refused("there must be a signal", [](Sensors& s) { s[0].signals.clear(); });
  refused("32 or 64", [](Sensors& s) { s[1].signals[0].length = 16; });
  refused("'south_tension' overlaps", [](Sensors& s) { s[1].signals[1].start = 31; });
  refused("'age' overlaps", [](Sensors& s) { s[0].age->start = 47; });
  refused("is there twice", [](Sensors& s) { s[0].signals[1].name = "age"; });
  refused("at most 32 sensors", [](Sensors& s) { s.resize(33, s[0]); });
  refused("64 signals, not 22 with 65", [](Sensors& s) { s.resize(22, s[0]); });
}

#ifndef TENDRIL_SANITIZED

TEST_CASE("Listening to sensors makes no heap call", "[rt]") {
  Listening listening({camera(0x1F0), load_cells()});
  const Frame first = sample(listening.configs[0], {0.01, 0.02, 0.03});
  const Frame second = sample(listening.configs[1], {1, 2});
  const uint64_t before = heap_calls();
  bool heard = true;
  for (int k = 0; k < 100; ++k) {
    heard = heard && listening.bank.receive(first, listening.now_ns) &&
            listening.bank.receive(second, listening.now_ns);
    listening.after(10 * kMillisecond_ns);
  }
  const uint64_t made = heap_calls() - before;
  CHECK(heard);
  CHECK(made == 0);
}

#endif

TEST_CASE("A loss is described with the sensor's name and limit", "[unit]") {
  CHECK(describe_loss({.name = "camera", .timeout_ns = 2'500'000}) ==
        "sensor 'camera': no sample younger than 2.5 ms");
}

}  // namespace tendril::hal::sensor_test
