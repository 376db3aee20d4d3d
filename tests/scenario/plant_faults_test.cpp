// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "app/config/master_config.h"
#include "app/config/plant_fault.h"
#include "app/config/plant_fault_parser.h"
#include "hal/drive/following_monitor.h"
#include "tests/scenario/robot_files.h"

// What the simulated robot can be made to suffer, in virtual time, on the finger with drives of both
// protocols: the same lines that tendril-plant takes on its standard input.

namespace tendril::app::plant_faults_test {

using Catch::Matchers::Contains;
using hal::FaultKind;
using rt::Phase;

constexpr double kStoppedWithin_s = 2.0;

Config finger_with(const std::string& protocol) {
  return protocol == "odrive" ? testing::with_odrive("finger") : testing::finger();
}

struct Running {
  explicit Running(const std::string& protocol = "canopen") : config(finger_with(protocol)), rig(config, {}) {
    REQUIRE(rig.run_until(Phase::kRunning, 3));
    rig.run_for(0.8);
    REQUIRE(rig.trace().back().faults.bits() == 0);
  }
  void inject(const std::string& line) { rig.drives().inject(parse_plant_fault(line, config)); }
  /// The run ends within its limits, with all drives off; what it says of the reason.
  hal::DriveFault stop() {
    REQUIRE(rig.run_until(Phase::kStopped, kStoppedWithin_s));
    CHECK(rig.controller().latched().fault == rt::Fault::kDrives);
    CHECK(testing::within_limits(config, rig.trace()));
    CHECK(rig.heap_calls() == 0);
    return rig.controller().latched().drive;
  }
  Config config;
  VirtualRig rig;
};

TEST_CASE("A drive that fails with a code of its own stops the robot, which tells that code", "[scenario]") {
  const auto [protocol, line, code] = GENERATE(table<std::string, std::string, uint32_t>(
      {{"canopen", "fault left emcy 0x2310", 0x2310}, {"odrive", "fault left error 0x40", 0x40}}));
  CAPTURE(protocol);
  Running run(protocol);
  run.inject(line);
  const hal::DriveFault fault = run.stop();
  CHECK(fault.kind == FaultKind::kDriveFault);
  CHECK(fault.axis == 1);
  CHECK(fault.code == code);
}

TEST_CASE("A drive whose heartbeats end stops the robot though all else goes on", "[scenario]") {
  const std::string protocol = GENERATE("canopen", "odrive");
  CAPTURE(protocol);
  Running run(protocol);
  run.inject("heartbeat left off");
  const hal::DriveFault fault = run.stop();
  CHECK(fault.kind == FaultKind::kHeartbeatLost);
  CHECK(fault.axis == 1);
}

TEST_CASE("A robot that loses every frame, or leaves the bus, stops the run for want of positions",
          "[scenario]") {
  const std::string protocol = GENERATE("canopen", "odrive");
  const std::string line = GENERATE("drop 100 %", "bus off", "delay 1 s");
  CAPTURE(protocol, line);
  Running run(protocol);
  run.inject(line);
  CHECK(run.stop().kind == FaultKind::kFeedbackLost);
}

TEST_CASE("Drives that nobody hears any more stop by themselves", "[scenario]") {
  const std::string protocol = GENERATE("canopen", "odrive");
  Running run(protocol);
  run.inject("bus off");
  run.rig.run_for(testing::heartbeat_timeout_s(run.config) + 0.25);
  for (int a = 0; a < 2; ++a) CHECK(run.rig.drives().drive(a).power_stage() == hal::PowerStage::kFault);
}

TEST_CASE("A few lost frames, or frames that are late by a few cycles, stop nothing", "[scenario]") {
  const std::string protocol = GENERATE("canopen", "odrive");
  const std::string line = GENERATE("drop 3 %", "delay 5 ms");
  CAPTURE(protocol, line);
  Running run(protocol);
  run.inject(line);
  run.rig.run_for(1);
  CHECK(run.rig.phase() == Phase::kRunning);
  CHECK_FALSE(run.rig.controller().latched().present);
  CHECK(testing::within_limits(run.config, run.rig.trace()));
}

TEST_CASE("An axis that is stuck stays where it is, and goes on once it is let go within the limit",
          "[scenario]") {
  const std::string protocol = GENERATE("canopen", "odrive");
  Running run(protocol);
  run.inject("stuck left");
  const PlantDisplacements before = run.rig.displacements();
  run.rig.run_for(0.3);
  CHECK(run.rig.displacements().delta_a[1] == before.delta_a[1]);
  CHECK(run.rig.displacements().delta_a[0] != before.delta_a[0]);
  CHECK(run.rig.drives().drive(1).power_stage() == hal::PowerStage::kOn);
  run.inject("clear");
  run.rig.run_for(0.2);
  CHECK(run.rig.displacements().delta_a[1] != before.delta_a[1]);
}

TEST_CASE("An axis that is stuck for long stops the robot, with what was commanded and what is measured",
          "[scenario]") {
  const std::string protocol = GENERATE("canopen", "odrive");
  CAPTURE(protocol);
  Running run(protocol);
  run.inject("stuck left");
  const double stands = run.rig.displacements().delta_a[1];
  REQUIRE(run.rig.run_until(Phase::kStopping, 3));
  const hal::DriveFault fault = run.stop();
  CHECK(fault.kind == FaultKind::kNotFollowing);
  CHECK(fault.axis == 1);
  CHECK(fault.measured == Approx(stands).margin(1e-5));
  CHECK(std::abs(fault.wanted - fault.measured) ==
        Approx(hal::following_error_limit(master_config(run.config).axes[1])).epsilon(0.1));
}

TEST_CASE("Drives that another controller has left enabled, with an offset, move by nothing at enabling",
          "[scenario]") {
  const std::string protocol = GENERATE("canopen", "odrive");
  CAPTURE(protocol);
  Config config = finger_with(protocol);
  config.plant->drives.left_enabled = true;
  VirtualRig rig(config, {});
  CHECK(rig.drives().drive(0).power_stage() == hal::PowerStage::kOn);
  const PlantDisplacements before = rig.displacements();
  REQUIRE(rig.run_until(Phase::kRunning, 3));
  for (int a = 0; a < 2; ++a) CHECK(std::abs(rig.displacements().delta_a[a] - before.delta_a[a]) < 2e-6);
  rig.run_for(1);
  CHECK(rig.phase() == Phase::kRunning);
  CHECK(testing::within_limits(config, rig.trace()));
}

TEST_CASE("Cut cables pull no more, whatever their drives do, and for good", "[scenario]") {
  Running sound, cut;
  cut.inject("cut right");
  cut.inject("cut left");
  sound.rig.run_for(0.5);
  cut.rig.run_for(0.5);
  // What the drives do is the same; the tip, which a cable pulled aside, has come back to the middle.
  CHECK(cut.rig.displacements().delta_a == sound.rig.displacements().delta_a);
  const double pulled = std::abs(sound.rig.measurements().back().tip.x());
  REQUIRE(pulled > 2e-3);
  CHECK(std::abs(cut.rig.measurements().back().tip.x()) < 0.1 * pulled);
  cut.inject("clear");
  cut.rig.run_for(0.1);
  CHECK(std::abs(cut.rig.measurements().back().tip.x()) < 0.1 * pulled);
}

TEST_CASE("A camera with noise errs by as much as it was told, and about nothing on the mean", "[scenario]") {
  Running run;
  run.inject("noise 0.2 mm");
  const int64_t since_ns = run.rig.now_ns() + 50'000'000;  // what is on its way is still without
  run.rig.run_for(4);
  int64_t seen_ns = 0;
  double sum = 0, squares = 0;
  int count = 0;
  for (const rt::TraceRecord& record : run.rig.trace()) {
    if (record.intended_ns < since_ns || record.sensors.stamp_ns[0] == seen_ns) continue;
    seen_ns = record.sensors.stamp_ns[0];
    const auto& tips = run.rig.measurements();
    const auto tip = std::lower_bound(tips.begin(), tips.end(), seen_ns - 2'000'000,
                                      [](const PlantMeasurement& t, int64_t ns) { return t.stamp_ns < ns; });
    REQUIRE(tip != tips.end());
    for (int c = 0; c < 3; ++c) {
      const double error = 1e3 * (record.sensors.value[c] - tip->tip[c]);
      sum += error;
      squares += error * error;
      ++count;
    }
  }
  REQUIRE(count > 300);
  CHECK(sum / count == Approx(0).margin(0.04));
  CHECK(std::sqrt(squares / count) == Approx(0.2).epsilon(0.15));
}

TEST_CASE("A robot file plans faults, counted from when the robot is ready", "[scenario]") {
  Config config = testing::finger();
  PlantFault fault = parse_plant_fault("heartbeat right off", config);
  fault.after = 2.5;
  config.plant->faults = {fault};
  VirtualRig rig(config, {});
  const int64_t start_ns = rig.now_ns();
  REQUIRE(rig.run_until(Phase::kStopping, 4));
  const double stopped_s = 1e-9 * static_cast<double>(rig.now_ns() - start_ns);
  CHECK(stopped_s > 2.5);
  CHECK(stopped_s < 2.5 + testing::heartbeat_timeout_s(config) + 0.05);
  CHECK_THAT(rig.master().describe(rig.controller().latched().drive), Contains("heartbeat lost"));
}

TEST_CASE("A robot that is on no bus from the start ends the run before any drive is enabled", "[scenario]") {
  const std::string protocol = GENERATE("canopen", "odrive");
  Config config = finger_with(protocol);
  config.plant->faults = {{.kind = PlantFaultKind::kBusOff}};
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kStopped, 12));
  CHECK(rig.controller().latched().drive.kind ==
        (protocol == "odrive" ? FaultKind::kStartTimeout : FaultKind::kConfiguration));
  for (const rt::TraceRecord& record : rig.trace()) REQUIRE(record.phase != Phase::kEnabling);
}

}  // namespace tendril::app::plant_faults_test
