#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <thread>

#include "hal/bus.h"
#include "tests/app/programs.h"
#include "tests/hal/raw_can.h"
#include "tests/hal/vcan0.h"

namespace tendril::app {
namespace {

using hal::testing::OwnInterface;

// An emulated machine takes minutes to draw a report.
constexpr double kDrawn_s = 600;

bool skipped() { return hal::testing::skipped_without_vcan0() || hal::testing::skipped_without_root(); }

/// A program that talks to others on the bus, all the time and more than a bus of 1 Mbit/s can carry, which
/// is 7.5 such frames a millisecond.
class Flood {
 public:
  explicit Flood(const std::string& interface) : bus_(hal::open_bus(interface, hal::BusRole::kJoin)) {}
  ~Flood() {
    quit_ = true;
    thread_.join();
  }

 private:
  void talk() {
    const std::vector<hal::Frame> frames(10, {.id = 0x7FF, .length = 8});
    while (!quit_) {
      bus_->send(frames);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  std::unique_ptr<hal::Bus> bus_;
  std::atomic<bool> quit_{false};
  std::thread thread_{[this] { talk(); }};
};

void require_running(Process& daemon, Workbench& bench) {
  const bool running = daemon.says("phase: run");
  INFO(daemon.err() << bench.plant().err());
  REQUIRE(running);
}

TEST_CASE(
    "An interface that goes down stops the robot with the reason, and serves the next run once it is up",
    "[vcan]") {
  if (skipped()) return;
  const OwnInterface interface;
  Workbench bench({}, interface.kName);
  Process daemon(bench.daemon());
  require_running(daemon, bench);
  REQUIRE(interface.set("down") == 0);
  CHECK(daemon.wait() == 1);
  INFO(daemon.err());
  CHECK(daemon.err().find("stopped: bus down") != std::string::npos);

  REQUIRE(interface.set("up") == 0);
  const Ended next = run(bench.daemon({"--duration", "1"}));
  INFO(next.err << bench.plant().err());
  CHECK(next.code == 0);
}

TEST_CASE("A controller that reports bus-off or error-passive stops the robot with the reason", "[vcan]") {
  if (skipped()) return;
  const auto [error_class, state, reason] = GENERATE(table<uint32_t, uint8_t, std::string>(
      {{CAN_ERR_BUSOFF, 0, "bus-off"}, {CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE, "bus error-passive"}}));
  const OwnInterface interface;
  Workbench bench({}, interface.kName);
  Process daemon(bench.daemon());
  require_running(daemon, bench);
  hal::testing::put_error(interface.kName, error_class, state);
  CHECK(daemon.wait() == 1);
  INFO(daemon.err());
  CHECK(daemon.err().find("stopped: " + reason) != std::string::npos);
}

TEST_CASE("What befalls drives of either protocol stops the robot with the reason", "[vcan]") {
  if (skipped()) return;
  const auto [changes, line, reason] = GENERATE(table<Changes, std::string, std::string>(
      {{{}, "fault left emcy 0x2310", "'left' (node 2): drive fault"},
       {{}, "heartbeat left off", "'left' (node 2): heartbeat lost"},
       {{}, "bus off", "lost"},
       {odrive("0.6"), "fault left error 0x40", "'left' (node 2): drive fault"},
       {odrive("0.6"), "heartbeat left off", "'left' (node 2): heartbeat lost"},
       {odrive("0.6"), "bus off", "lost"}}));
  CAPTURE(line, changes.size());
  const OwnInterface interface;
  Workbench bench(changes, interface.kName);
  Process daemon(bench.daemon());
  require_running(daemon, bench);
  bench.plant().write_line(line);
  CHECK(daemon.wait() == 1);
  INFO(daemon.err() << bench.plant().err());
  const std::string::size_type stopped = daemon.err().find("stopped: ");
  REQUIRE(stopped != std::string::npos);
  CHECK(daemon.err().find(reason, stopped) != std::string::npos);
}

TEST_CASE("What others tell each other, however much, costs the controller no frame", "[vcan]") {
  if (skipped()) return;
  const OwnInterface interface;
  Workbench bench({}, interface.kName);
  Process daemon(bench.daemon({"--duration", "2", "--report", bench.report()}));
  {
    const Flood flood(interface.kName);
    CHECK(daemon.says("drives disabled"));
  }
  CHECK(daemon.wait(kDrawn_s) == 0);
  INFO(daemon.err() << bench.plant().err());
  const nlohmann::json summary = read_summary(bench.report());
  CHECK(summary["faults"].empty());
  CHECK(summary["bus_dropped"] == 0);
  // Only our own frames count: at 200 Hz, 4 PDOs of 6 bytes and a SYNC, heartbeats, the camera.
  CHECK(summary["bus_load"] > 0.01);
  CHECK(summary["bus_load"] < 0.20);
}

}  // namespace
}  // namespace tendril::app
