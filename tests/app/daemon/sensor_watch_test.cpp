// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/sensor_watch.h"

#include <catch2/catch.hpp>

using namespace tendril;
namespace tendril::app::sensor_watch_test {

/// A robot with a camera and a gauge, and the cycles of a run at 100 Hz.
struct Run {
  /// One cycle. @return what is told of it: "-0" where sensor 0 is lost, "+0" where it is back
  std::string cycle(bool camera_fresh, bool gauge_fresh, rt::Phase phase = rt::Phase::kRunning) {
    rt::TraceRecord record;
    record.phase = phase;
    record.intended_ns = (at_ns += 10'000'000);
    record.sensors.fresh[0] = camera_fresh;
    record.sensors.fresh[1] = gauge_fresh;
    std::string told;
    for (const SensorWatch::Change& change : watch.add(record)) {
      told += change.lost ? '-' : '+';
      told += std::to_string(change.sensor);
      stale_s = change.stale_s;
    }
    return told;
  }

  static Config two_sensors() {
    Config config;
    config.sensors.resize(2);
    return config;
  }

  Config config = two_sensors();
  SensorWatch watch{config};
  int64_t at_ns = 5'000'000'000;
  double stale_s = 0;  // as told last
};

TEST_CASE("A sensor's loss is told once, and so is its return with how long it was away", "[unit]") {
  Run run;
  CHECK(run.cycle(true, true) == "");
  CHECK(run.cycle(false, true) == "-0");
  CHECK(run.cycle(false, true) == "");
  CHECK(run.cycle(false, false) == "-1");
  CHECK(run.cycle(true, false) == "+0");
  CHECK(run.stale_s == Approx(0.03));
  CHECK(run.cycle(true, true) == "+1");
  CHECK(run.stale_s == Approx(0.02));
  CHECK(run.cycle(false, true) == "-0");
  CHECK(run.watch.losses()[0].count == 2);
  CHECK(run.watch.losses()[0].lost);
  CHECK(run.watch.losses()[1].count == 1);
}

TEST_CASE("The time without a sensor is counted up to now, in all", "[unit]") {
  Run run;
  for (const bool fresh : {true, false, false, true, true, false, false, false}) run.cycle(fresh, true);
  CHECK(run.watch.losses()[0].stale_s() == Approx(0.02 + 0.02));
  CHECK(run.watch.losses()[1].stale_s() == 0);
}

TEST_CASE("A sensor that is silent before the drives follow is lost when they do, not earlier", "[unit]") {
  Run run;
  CHECK(run.cycle(false, true, rt::Phase::kConnecting) == "");
  CHECK(run.cycle(false, true, rt::Phase::kEnabling) == "");
  CHECK(run.cycle(false, true) == "-0");
  CHECK(run.cycle(false, true) == "");
  CHECK(run.cycle(false, false, rt::Phase::kStopping) == "");
  CHECK(run.watch.losses()[0].stale_s() == Approx(0.01));
}

}  // namespace tendril::app::sensor_watch_test
