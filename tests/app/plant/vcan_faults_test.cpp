// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <thread>

#include "hal/bus/open_bus.h"
#include "tests/app/plant/faults.h"
#include "tests/hal/bus/raw_can.h"
#include "tests/hal/bus/vcan0.h"
#include "tests/patience.h"

namespace tendril::app::vcan_faults_test {

using hal::testing::OwnInterface;

bool skipped() { return hal::testing::skipped_without_vcan0() || hal::testing::skipped_without_root(); }

/// A program that talks to others on the bus, all the time and more than a bus of 1 Mbit/s can carry, which
/// is 7.5 such frames a millisecond. An emulated machine, which could do nothing else then, hears less.
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
      std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(tendril::testing::slowness()));
    }
  }

  std::unique_ptr<hal::Bus> bus_;
  std::atomic<bool> quit_{false};
  std::thread thread_{[this] { talk(); }};
};

TEST_CASE(
    "An interface that goes down stops the robot with the reason, and serves the next run once it is up",
    "[vcan]") {
  if (skipped()) return;
  const OwnInterface interface;
  Workbench bench({}, interface.name());
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
  const OwnInterface interface;
  Workbench bench({}, interface.name());
  struct Row {
    uint32_t error_class;
    uint8_t state;
    std::string reason;
  };
  for (const Row& row :
       {Row{CAN_ERR_BUSOFF, 0, "bus-off"}, Row{CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE, "bus error-passive"}}) {
    Process daemon(bench.daemon());
    require_running(daemon, bench);
    hal::testing::put_error(interface.name(), row.error_class, row.state);
    CHECK(daemon.wait() == 1);
    INFO(daemon.err());
    CHECK(daemon.err().find("stopped: " + row.reason) != std::string::npos);
  }
}

TEST_CASE("What befalls drives stops the robot with the reason over a CAN interface, too", "[vcan]") {
  if (skipped()) return;
  const OwnInterface interface;
  using Row = std::pair<Changes, Faults>;
  const auto [changes, faults] = GENERATE(
      Row{{}, {{"fault left emcy 0x2310", "'left' (node 2): drive fault"}}},
      Row{odrive("0.6"), {{"fault left error 0x40", "'left' (node 2): drive fault: missing input"}}});
  Workbench bench(changes, interface.name());
  check_stops(bench, faults);
}

TEST_CASE("What others tell each other, however much, costs the controller no frame", "[vcan]") {
  if (skipped()) return;
  const OwnInterface interface;
  Workbench bench({}, interface.name());
  Process daemon(without_pictures(bench.daemon({"--report", bench.report()})));
  {
    const Flood flood(interface.name());
    require_running(daemon, bench);
    Ear ear(interface.name(), {0x080});
    int cycles = 0;
    CHECK(ear.hears({[&cycles](const hal::Frame&) { return ++cycles == 400; }}));
    daemon.send(SIGTERM);
    CHECK(daemon.says("drives disabled"));
  }
  CHECK(daemon.wait() == 0);
  INFO(daemon.err() << bench.plant().err());
  const nlohmann::json summary = read_summary(bench.report());
  // Two cables for one coordinate: where snapshots come late, the QP may need more than its cap.
  for (const auto& fault : summary["faults"])
    CHECK_THAT(fault.get<std::string>(), Catch::StartsWith("the QP was stopped at its"));
  // The queue of the controller, which overflows where nobody reads for a third of a second: that is a
  // stall of the machine, and in an emulated one may come before the first cycle, where nothing tells of it.
  if (tendril::testing::slowness() <= 1 && summary["wakeup_us"]["max"] < 1e5 &&
      summary["cycle_us"]["max"] < 1e5)
    CHECK(summary["bus_dropped"] == 0);
  // Only our own frames count: at 200 Hz, 4 PDOs of 6 bytes and a SYNC, heartbeats, the camera. Each cycle
  // that was not missed has two of these PDOs and the SYNC at least, 2 x 115 and 65 bits, but for the first.
  const auto cycles = static_cast<double>(read_trace(bench.report()).of({"approach", "run"}).size());
  CHECK(cycles >= 400);
  CHECK(1e6 * summary["bus_load"].get<double>() * summary["duration_s"].get<double>() >= 295 * (cycles - 1));
  CHECK(summary["bus_load"] < 0.20);
}

}  // namespace tendril::app::vcan_faults_test
