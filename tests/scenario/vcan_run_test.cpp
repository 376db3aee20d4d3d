// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "hal/bus/open_bus.h"
#include "hal/sensor/signal.h"
#include "tests/hal/bus/vcan0.h"
#include "tests/own_folder.h"
#include "tests/patience.h"
#include "tests/replace_each.h"
#include "tests/scenario/robot_files.h"

namespace fs = std::filesystem;

namespace {

std::string content(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

using tendril::testing::comes_true;
using tendril::testing::kPatience_s;

/// A program that runs beside the test and writes all it says into a file; killed with the object.
class Program {
 public:
  Program(std::vector<std::string> words, const fs::path& output) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_APPEND,
                                     0600);
    posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
    const int error = ::posix_spawn(&pid_, arguments[0], &files, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    INFO(words[0]);
    REQUIRE(error == 0);
  }
  ~Program() {
    if (ended()) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  bool ended() {
    if (!ended_) ended_ = ::waitpid(pid_, &status_, WNOHANG) == pid_;
    return ended_;
  }

  /// Its exit code once it has ended; -1 where it does not, or of a signal.
  int exit_code() {
    const bool in_time = comes_true([this] { return ended(); });
    return in_time && WIFEXITED(status_) ? WEXITSTATUS(status_) : -1;
  }

  void terminate() { ::kill(pid_, SIGTERM); }

 private:
  pid_t pid_ = -1;
  int status_ = 0;
  bool ended_ = false;
};

/// A robot file with time limits so wide that a machine which stalls is no fault, a low rate, and a cap for
/// the QP, without which the daemon refuses a machine too slow for the rate: this test is not about time.
void write_patiently(std::string yaml, const fs::path& file) {
  const auto replace = [&yaml](const std::string& from, const std::string& to) {
    INFO(from);
    const size_t at = yaml.find(from);
    REQUIRE(at != std::string::npos);
    yaml.replace(at, from.size(), to);
  };
  replace("rate: 600 Hz", "rate: 100 Hz\n  model_rate_limit: 20 Hz\n  iteration_cap: 32");
  replace("snapshot_age_limit: 500 ms", "snapshot_age_limit: 30 s");
  replace("target_age_limit: 500 ms", "target_age_limit: 30 s");
  replace("late_cycles_limit: 20", "late_cycles_limit: 20000");
  replace("  bitrate: 1 Mbit/s\n",
          "  bitrate: 1 Mbit/s\n  heartbeat_timeout: 30 s\n  feedback_timeout: 30 s\n"
          "  boot_timeout: 10 s\n  enable_timeout: 60 s\n  disable_timeout: 10 s\n");
  std::ofstream(file) << yaml;
}

/// Share of its time steps for which the simulated body was too slow, %, as it says when it ends.
double steps_missed(const std::string& plant_log) {
  const std::string before = "too slow for ";
  const size_t at = plant_log.find(before);
  REQUIRE(at != std::string::npos);
  return std::stod(plant_log.substr(at + before.size()));
}

/// What a camera tells of the tip.
class Watcher {
 public:
  /// @param camera  the identifier of its frames
  Watcher(const std::string& interface, uint32_t camera)
      : bus_(tendril::hal::open_bus(interface, tendril::hal::BusRole::kJoin, std::array{camera})) {}

  /// Whether it has seen the tip close to the one end of the path, after that close to the other, and for
  /// some frames more. The path leads 5 mm to either side.
  bool saw_both_ends() {
    const tendril::hal::Signal x{.name = "", .length = 16, .type = tendril::hal::SignalType::kSigned};
    for (tendril::hal::Frame frame; bus_->receive(frame); ++frames_) {
      x_mm_ = 0.01 * tendril::hal::decode(x, frame).value_or(0);
      first_ = first_ || x_mm_ > 3.5;
      if (after_ > 0 || (first_ && x_mm_ < -3.5)) ++after_;
    }
    return after_ > 30;
  }

  /// How far it has come, for people.
  std::string text() const {
    return std::to_string(frames_) +
           " frames of the camera, the last with the tip at x = " + std::to_string(x_mm_) +
           " mm; the first end was " + (first_ ? "" : "not ") + "seen";
  }

 private:
  std::unique_ptr<tendril::hal::Bus> bus_;
  int frames_ = 0;
  double x_mm_ = 0;
  bool first_ = false;
  int after_ = 0;  // frames from the second end on
};

/// Lets plant and daemon run over a CAN interface and checks what they leave.
/// @param yaml    the finger, without a heartbeat timeout
/// @param camera  the identifier of its frames
void check_run(const std::string& yaml, uint32_t camera) {
  const tendril::hal::testing::Vcan vcan;
  const tendril::testing::OwnFolder folder;
  const std::string robot = folder / "finger.yaml", report = folder / "report";
  write_patiently(yaml, robot);

  Program plant({TENDRIL_PLANT, robot, "--bus", vcan.name()}, folder / "plant.log");
  const auto plant_is_ready = [&] {
    return content(folder / "plant.log").find("ready\n") != std::string::npos;
  };
  const bool ready = comes_true([&] { return plant_is_ready() || plant.ended(); });
  INFO("the plant: " << content(folder / "plant.log"));
  REQUIRE(ready);
  // Python that does not start draws no pictures of the run, which would take longer than it. Below a device
  // there is no folder on any machine.
  Program daemon({"/usr/bin/env", "PYTHONHOME=/dev/null/none", TENDRIL_DAEMON, robot, "--bus", vcan.name(),
                  "--allow-non-rt", "--report", report},
                 folder / "daemon.log");
  const auto is_running = [&] {
    return content(folder / "daemon.log").find("phase: run") != std::string::npos;
  };
  const bool runs = comes_true([&] { return is_running() || daemon.ended(); });
  Watcher watcher(vcan.name(), camera);
  // An emulated machine is given no more time for this: see below.
  const bool seen = comes_true([&] { return watcher.saw_both_ends() || daemon.ended(); },
                               kPatience_s / tendril::testing::slowness());
  if (!daemon.ended()) daemon.terminate();
  const int daemon_code = daemon.exit_code();
  plant.terminate();
  const int plant_code = plant.exit_code();

  const std::string plant_log = content(folder / "plant.log"), daemon_log = content(folder / "daemon.log");
  INFO(plant_log << daemon_log);
  INFO(watcher.text());
  REQUIRE(runs);
  REQUIRE(plant_code == 0);
  REQUIRE(daemon_log.find("phase: run") != std::string::npos);
  // An emulated machine takes a second for a step: the body then lags far behind its cables, and now and then
  // its drives are silent for longer than the daemon lets them.
  if (steps_missed(plant_log) > 50) {
    WARN("skipped: the drives were enabled over CAN, but the machine is too slow to simulate the finger");
    return;
  }
  CHECK(seen);
  CHECK(daemon_code == 0);
  CHECK(watcher.saw_both_ends());
  const nlohmann::json summary = nlohmann::json::parse(content(folder / "report/summary.json"));
  INFO(summary.dump(2));
  CHECK(summary["bus"] == "CAN interface " + vcan.name());
  CHECK(summary["faults"].empty());
  // The queue of the controller, which overflows where nobody reads for a third of a second: that is a
  // stall of the machine, and in an emulated one may come before the first cycle, where nothing tells of it.
  if (tendril::testing::slowness() <= 1 && summary["wakeup_us"]["max"] < 1e5 &&
      summary["cycle_us"]["max"] < 1e5)
    CHECK(summary["bus_dropped"] == 0);
  // How close it keeps to the path in between, where the machine does not stall, path_test.cpp plays in
  // virtual time.
  CHECK(summary["tracking_error_mm"]["samples"] > 10);
}

}  // namespace

TEST_CASE("The daemon moves the simulated finger along its path over a SocketCAN interface", "[vcan]") {
  if (tendril::hal::testing::skipped_without_vcan0()) return;
  const fs::path shipped = fs::path(TENDRIL_SOURCE_DIR) / "config";
  std::string yaml = content(shipped / "finger.yaml");
  tendril::testing::replace_each(yaml, "file: ", "", "file: " + shipped.string() + "/");
  tendril::testing::replace_each(yaml, "  heartbeat_timeout: ", "\n", "");
  check_run(yaml, 0x1F0);
}

TEST_CASE("The daemon moves ODrive axes over a SocketCAN interface as it moves CiA 402 drives", "[vcan]") {
  if (tendril::hal::testing::skipped_without_vcan0()) return;
  check_run(tendril::app::testing::odrive_yaml("finger"), 0x7F0);
}
