// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/check/private_bus.h"
#include "app/daemon/daemon.h"
#include "app/plant/plant.h"
#include "hal/bus/open_bus.h"
#include "hal/cia402/cia402_settings.h"
#include "rt/periodic_clock.h"
#include "tests/app/robot/block.h"
#include "tests/own_folder.h"

// The whole daemon in one process with its drives: what the thread sanitizer is to look at, since elsewhere
// it runs as a program. The body has 300 tetrahedra.

namespace tendril::app::daemon_threads_test {

/// So that no limit of time is reached on a slow machine.
Config patient(Config config) {
  config.control.rate_hz = 100;
  config.control.iteration_cap = 64;
  config.control.late_cycles_limit = 1'000'000;
  config.control.snapshot_age_limit = config.control.target_age_limit = 300;
  hal::MasterConfig& master = config.bus.master;
  master.heartbeat_timeout_ns = master.feedback_timeout_ns = 30'000'000'000;
  hal::cia402_settings(master).sdo_timeout_ns = 30'000'000'000;
  return config;
}

/// Drives and sensors of a simulated robot without a body, served by a thread of their own.
class ServedDrives {
 public:
  explicit ServedDrives(const Config& config)
      : drives_(config), bus_(hal::open_bus(medium_.name(), hal::BusRole::kHost)) {}
  ~ServedDrives() {
    quit_ = true;
    thread_.join();
  }

  std::string bus() const { return medium_.name(); }
  /// The first drive reports a fault once it is enabled.
  void fail_when_enabled() { fail_when_enabled_ = true; }

 private:
  void serve() {
    for (bool failed = false; !quit_; std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
      const PlantMeasurement nothing{.stamp_ns = rt::now_ns()};
      drives_.serve(*bus_, nothing, nothing.stamp_ns);
      if (fail_when_enabled_ && !failed && drives_.displacements().delta_a[kAir] != 0) {
        drives_.inject({.kind = PlantFaultKind::kDriveFault, .axis = kAir, .value = 0x2310});
        failed = true;
      }
    }
  }

  PrivateBus medium_;
  PlantDrives drives_;
  std::unique_ptr<hal::Bus> bus_;
  std::atomic<bool> quit_{false}, fail_when_enabled_{false};
  std::thread thread_{[this] { serve(); }};
};

nlohmann::json summary_in(const std::filesystem::path& report) {
  return nlohmann::json::parse(std::ifstream(report / "summary.json"));
}

TEST_CASE("Model, control and main thread of the daemon run a robot together from start to stop", "[rt]") {
  setenv("PYTHONHOME", "/dev/null/none", 1);  // no pictures: Python does not start
  const Block block;
  const Config config = patient(block.config);
  const testing::OwnFolder folder;
  ServedDrives drives(config);
  const DaemonOptions options{.bus = drives.bus(),
                              .duration_s = 1,
                              .report = folder / "report",
                              .log = folder / "run.mcap",
                              .metrics = "0",
                              .socket = block.file.folder() / "robot.sock",
                              .allow_non_rt = true};
  CHECK(run_daemon(config, options) == 0);
  const nlohmann::json summary = summary_in(options.report);
  CHECK(summary["faults"].empty());
  CHECK(summary["warnings"].empty());
  CHECK(summary["model_refreshes"] >= 2);
  CHECK(std::filesystem::file_size(options.log) > 10'000);
  CHECK(summary["qp"]["statuses"]["optimal"] >= 1);
}

TEST_CASE("A drive's fault reaches all threads of the daemon, and ends them", "[rt]") {
  setenv("PYTHONHOME", "/dev/null/none", 1);
  const Block block;
  Config config = patient(block.config);
  config.control.on_fault = OnFault::kExit;
  const testing::OwnFolder folder;
  ServedDrives drives(config);
  drives.fail_when_enabled();
  const DaemonOptions options{.bus = drives.bus(),
                              .report = folder / "report",
                              .log = folder / "run.mcap",
                              .metrics = "0",
                              .socket = block.file.folder() / "robot.sock",
                              .allow_non_rt = true};
  CHECK(run_daemon(config, options) == 1);
  const nlohmann::json summary = summary_in(options.report);
  REQUIRE(summary["faults"].size() == 1);
  CHECK_THAT(summary["faults"][0].dump(), Catch::Contains("'air' (node 1): drive fault"));
}

}  // namespace tendril::app::daemon_threads_test
