// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "app/config/plant_fault_parser.h"
#include "app/daemon/sensor_watch.h"
#include "tests/scenario/robot_files.h"

// What sensors on the bus tell of the simulated robot, and what their loss leads to: all of Tendril in
// virtual time.

namespace tendril::app::sensors_test {

using rt::Fault;
using rt::Phase;

// The body is 10 % stiffer than the model, and its efforts as much larger.
constexpr double kModelShare = 0.12;       // of the largest effort, mean
constexpr int64_t kOnItsWay_ns = 290'000;  // a frame; less by the rounding of the age than it takes
constexpr double kNoticedWithin_s = 0.03;  // beside the sensor's timeout
constexpr double kStoppedWithin_s = 1.0;   // from a fault to disabled drives

struct Running {
  explicit Running(const Config& robot) : config(robot), rig(config, {}) {
    REQUIRE(rig.run_until(Phase::kRunning, 4));
    rig.run_for(1);
    REQUIRE(rig.trace().back().faults.bits() == 0);
  }
  void inject(const std::string& line) { rig.drives().inject(parse_plant_fault(line, config)); }
  const hal::SensorReadings& sensors() const { return rig.trace().back().sensors; }

  Config config;
  VirtualRig rig;
};

/// The finger, whose load cells it may not lose.
Config careful_finger() {
  Config config = testing::finger();
  config.sensors[1].frame.required = true;
  return config;
}

/// Mean distance of a signal, in the running robot, from what it measures and from the model's effort.
struct Distance {
  double to_body = 0, to_model = 0, largest = 0;
  int samples = 0;
};
Distance distance(const VirtualRig& rig, int sensor, int signal, int actuator) {
  Distance d;
  int64_t known_ns = 0;
  auto body = rig.measurements().begin();
  for (const rt::TraceRecord& record : rig.trace()) {
    const int64_t stamp_ns = record.sensors.stamp_ns[sensor];
    if (record.phase != Phase::kRunning || stamp_ns == known_ns) continue;
    known_ns = stamp_ns;
    while (body + 1 != rig.measurements().end() && (body + 1)->stamp_ns <= stamp_ns - kOnItsWay_ns) ++body;
    const double value = record.sensors.value[signal];
    d.to_body += std::abs(value - body->measured[signal]);
    d.to_model += std::abs(value - record.lambda[actuator]);
    d.largest = std::max(d.largest, value);
    ++d.samples;
  }
  d.to_body /= d.samples;
  d.to_model /= d.samples;
  return d;
}

TEST_CASE("Load cells tell the tension in the simulated body, which is near the model's", "[scenario]") {
  Running run(testing::finger());
  run.rig.run_for(3);
  for (const int cable : {0, 1}) {
    const Distance d = distance(run.rig, 1, 3 + cable, cable);
    CAPTURE(cable, d.to_body, d.to_model, d.largest);
    CHECK(d.samples > 300);
    CHECK(d.to_body < 1e-4);  // one count
    CHECK(d.largest > 0.2);
    CHECK(d.to_model < kModelShare * d.largest);
  }
}

TEST_CASE("A pressure gauge tells the pressure in the simulated chamber, which is near the model's",
          "[scenario]") {
  Running run(testing::shipped("bender"));
  run.rig.run_for(3);
  const Distance d = distance(run.rig, 1, 3, 0);
  CAPTURE(d.to_body, d.to_model, d.largest);
  CHECK(d.samples > 300);
  CHECK(d.to_body < 2);  // one count
  CHECK(d.largest > 5e3);
  CHECK(d.to_model < kModelShare * d.largest);
}

TEST_CASE("A sensor that may be lost is missed and found again, and the robot goes on", "[scenario]") {
  Running run(testing::finger());
  run.inject("sensor camera off");
  run.rig.run_for(0.4);
  CHECK_FALSE(run.sensors().fresh[0]);
  CHECK(run.sensors().fresh[1]);
  run.inject("clear");
  run.rig.run_for(0.1);
  CHECK(run.sensors().fresh[0]);
  CHECK(run.rig.phase() == Phase::kRunning);
  SensorWatch watch(run.config);
  for (const rt::TraceRecord& record : run.rig.trace()) {
    CHECK(record.faults.bits() == 0);
    watch.add(record);
  }
  const double timeout_s = 1e-9 * static_cast<double>(run.config.sensors[0].frame.timeout_ns);
  CHECK(watch.losses()[0].count == 1);
  CHECK(watch.losses()[0].stale_s() == Approx(0.4 - timeout_s).margin(kNoticedWithin_s));
  CHECK(watch.losses()[1].count == 0);
}

TEST_CASE("A sensor that may not be lost stops the robot within its timeout", "[scenario]") {
  Running run(careful_finger());
  run.inject("sensor load_cells off");
  const int64_t since_ns = run.rig.now_ns();
  REQUIRE(run.rig.run_until(Phase::kStopping, 1));
  const double noticed_s = 1e-9 * static_cast<double>(run.rig.now_ns() - since_ns);
  const double timeout_s = 1e-9 * static_cast<double>(run.config.sensors[1].frame.timeout_ns);
  CHECK(noticed_s > timeout_s - 0.02);
  CHECK(noticed_s < timeout_s + kNoticedWithin_s);
  REQUIRE(run.rig.run_until(Phase::kStopped, kStoppedWithin_s));
  CHECK(run.rig.controller().latched().fault == Fault::kSensorLost);
  CHECK(run.rig.controller().latched().lost_sensor == 1);
  CHECK(testing::within_limits(run.config, run.rig.trace()));
  CHECK(run.rig.heap_calls() == 0);
}

TEST_CASE("No drive is enabled where a sensor that may not be lost is never heard", "[scenario]") {
  Config config = careful_finger();
  config.plant->faults = {parse_plant_fault("sensor load_cells off", config)};
  VirtualRig rig(config, {});
  REQUIRE(rig.run_until(Phase::kStopped, 8));
  CHECK(rig.controller().latched().fault == Fault::kSensorLost);
  for (const rt::TraceRecord& record : rig.trace()) CHECK(record.phase != Phase::kEnabling);
}

TEST_CASE("Load cells with noise err by as much as they were told, the camera not at all", "[scenario]") {
  Running run(testing::finger());
  run.inject("noise 20 mN");
  const std::size_t first = run.rig.trace().size() + 60;
  run.rig.run_for(3);
  int64_t known_ns = 0;
  double squares = 0;
  int samples = 0;
  for (std::size_t k = first; k < run.rig.trace().size(); ++k) {
    const rt::TraceRecord& record = run.rig.trace()[k];
    if (record.sensors.stamp_ns[1] == known_ns) continue;
    known_ns = record.sensors.stamp_ns[1];
    const auto& seen = run.rig.measurements();
    const auto body = std::find_if(seen.rbegin(), seen.rend(), [&](const PlantMeasurement& measurement) {
      return measurement.stamp_ns <= known_ns - kOnItsWay_ns;
    });
    squares += std::pow(record.sensors.value[3] - body->measured[3], 2);
    ++samples;
  }
  CHECK(samples > 250);
  CHECK(std::sqrt(squares / samples) == Approx(0.02).epsilon(0.15));
  const Distance camera = distance(run.rig, 0, 0, 0);
  CHECK(camera.samples > 300);
  CHECK(camera.to_body < 1e-5);  // one count
}

}  // namespace tendril::app::sensors_test
