// SPDX-License-Identifier: Apache-2.0
#include "app/jog/jog.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

// One axis moved by hand: where it ends, how fast it goes, and what makes it let go.

namespace tendril::app::jog_test {

constexpr double kPeriod = 0.002;

JogConfig two_millimetres() {
  JogConfig config;
  config.distance = 2e-3;
  config.speed = 1e-3;
  config.least = -5e-3;
  config.greatest = 5e-3;
  config.lag = 0.5e-3;
  config.period_s = kPeriod;
  return config;
}

/// A drive that is where it was told to be a cycle ago, as long as it is enabled.
struct Drive {
  explicit Drive(double position) { measurement.displacement[0] = position; }

  void follow(const hal::Command& command) {
    measurement.axes = 1;
    measurement.all_known = true;
    if (measurement.all_enabled && !blocked) measurement.displacement[0] = command.displacement[0];
    measurement.all_enabled = command.enable;
    measurement.all_disabled = measurement.finished = command.finish;
  }

  hal::Measurement measurement;
  bool blocked = false;
};

/// One cycle of a jog, which needs neither snapshot nor target.
const rt::Decision& step(Jog& jog, const Drive& drive, bool stop = false) {
  return jog.step(drive.measurement, nullptr, nullptr, {.stop_requested = stop});
}

/// Commands of every cycle until the jog is done.
std::vector<double> run(Jog& jog, Drive& drive, double stop_at_s = 1e9) {
  std::vector<double> commands;
  rt::Phase phase = rt::Phase::kConnecting;
  for (int k = 0; k < 100'000 && phase != rt::Phase::kStopped; ++k) {
    const rt::Decision& decision = step(jog, drive, k * kPeriod >= stop_at_s);
    phase = decision.phase;
    commands.push_back(decision.command.displacement[0]);
    drive.follow(decision.command);
  }
  REQUIRE(phase == rt::Phase::kStopped);
  return commands;
}

TEST_CASE("A jog ends where it was asked to, either way, and the drive is let go", "[unit]") {
  for (const double distance : {2e-3, -3e-3, 1e-6, 0.0}) {
    JogConfig config = two_millimetres();
    config.distance = distance;
    Jog jog(config);
    Drive drive(1e-3);
    run(jog, drive);
    CHECK(jog.ending() == Jog::Ending::kArrived);
    CHECK(jog.start() == 1e-3);
    CHECK(drive.measurement.displacement[0] == Approx(1e-3 + distance).margin(1e-12));
    CHECK_FALSE(drive.measurement.all_enabled);
  }
}

TEST_CASE("A jog goes on from the last command that the bus took, and still ends where it was asked to",
          "[unit]") {
  const JogConfig config = two_millimetres();
  Jog jog(config);
  Drive drive(1e-3);
  double known = 0;  // to the drive
  rt::Phase phase = rt::Phase::kConnecting;
  for (int k = 0; k < 10'000 && phase != rt::Phase::kStopped; ++k) {
    const bool lost = k > 0 && k % 200 > 180;  // what the last cycle commanded
    const rt::Decision& decision = jog.step(drive.measurement, nullptr, nullptr, {.undelivered = lost});
    if (phase >= rt::Phase::kRunning && !lost)
      CHECK(std::abs(decision.command.displacement[0] - known) <= 2 * config.speed * kPeriod);
    phase = decision.phase;
    known = decision.command.displacement[0];
    drive.follow(decision.command);
  }
  CHECK(phase == rt::Phase::kStopped);
  CHECK(jog.ending() == Jog::Ending::kArrived);
  CHECK(drive.measurement.displacement[0] == Approx(3e-3).margin(1e-12));
}

TEST_CASE("A jog keeps to its speed and starts and ends without a jerk", "[unit]") {
  Jog jog(two_millimetres());
  Drive drive(0);
  const std::vector<double> commands = run(jog, drive);
  double fastest = 0, strongest = 0;
  for (std::size_t k = 2; k < commands.size(); ++k) {
    const double v = (commands[k] - commands[k - 1]) / kPeriod,
                 before = (commands[k - 1] - commands[k - 2]) / kPeriod;
    CHECK(v >= 0);
    fastest = std::max(fastest, v);
    strongest = std::max(strongest, std::abs(v - before) / kPeriod);
  }
  CHECK(fastest == Approx(1e-3));
  CHECK(strongest <=
        1.01 * 1e-3 / 0.25 + 1e-3 * kPeriod / kPeriod);  // the ramp, and rounding to the goal at its end
}

TEST_CASE("A goal outside the limits is refused before the drive is enabled", "[unit]") {
  Jog jog(two_millimetres());
  Drive drive(3.5e-3);
  for (int k = 0; k < 10; ++k) {
    const hal::Command& command = step(jog, drive).command;
    CHECK_FALSE(command.enable);
    drive.follow(command);
  }
  CHECK(jog.ending() == Jog::Ending::kBeyond);
}

TEST_CASE("An axis found outside its limits can be led back", "[unit]") {
  JogConfig config = two_millimetres();
  config.distance = -2e-3;
  Jog jog(config);
  Drive drive(6e-3);
  run(jog, drive);
  CHECK(jog.ending() == Jog::Ending::kArrived);
}

TEST_CASE("An axis that does not move is let go as soon as it lags too far behind", "[unit]") {
  Jog jog(two_millimetres());
  Drive drive(0);
  drive.blocked = true;
  const std::vector<double> commands = run(jog, drive);
  CHECK(jog.ending() == Jog::Ending::kStrayed);
  CHECK(commands.back() == Approx(0.5e-3).epsilon(0.01));
}

TEST_CASE("An axis whose position is not a number is let go", "[unit]") {
  Jog jog(two_millimetres());
  Drive drive(0);
  for (int k = 0; k < 100; ++k) drive.follow(step(jog, drive).command);
  REQUIRE(step(jog, drive).phase == rt::Phase::kRunning);
  drive.measurement.displacement[0] = std::nan("");
  CHECK_FALSE(step(jog, drive).command.enable);
  CHECK(jog.ending() == Jog::Ending::kStrayed);
}

TEST_CASE("A jog that is stopped on its way comes to a halt and ends there", "[unit]") {
  Jog jog(two_millimetres());
  Drive drive(0);
  const std::vector<double> commands = run(jog, drive, 1.0);
  CHECK(jog.ending() == Jog::Ending::kStopped);
  CHECK(commands.back() > 0.5e-3);
  CHECK(commands.back() < 1.2e-3);
}

TEST_CASE("A drive's fault ends a jog, and is kept, with the cause that is told afterwards", "[unit]") {
  Jog jog(two_millimetres());
  Drive drive(0);
  for (int k = 0; k < 100; ++k) drive.follow(step(jog, drive).command);
  drive.measurement.fault = {.kind = hal::FaultKind::kDriveFault, .axis = 0, .code = 0x2310};
  CHECK_FALSE(step(jog, drive).command.enable);
  CHECK(jog.ending() == Jog::Ending::kDriveFault);
  CHECK(jog.drive_fault().code == 0x2310);
  drive.measurement.fault.code = 0x2320;
  step(jog, drive);
  CHECK(jog.drive_fault().code == 0x2320);
}

}  // namespace tendril::app::jog_test
