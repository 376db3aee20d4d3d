#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <csignal>
#include <functional>
#include <thread>

#include "hal/bus/open_bus.h"
#include "hal/canopen/canopen.h"
#include "hal/canopen/emergency.h"
#include "hal/odrive/odrive.h"
#include "hal/sensor/signal.h"
#include "tests/app/program/programs.h"
#include "tests/hal/bus/raw_can.h"
#include "tests/hal/bus/vcan0.h"

namespace tendril::app::vcan_faults_test {

using hal::testing::OwnInterface;

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

/// What befalls a robot, as a line to the plant, and the reason with which it then stops.
using Faults = std::vector<std::pair<std::string, std::string>>;

/// Lets it all befall one robot, run by run; each run clears what the former has left.
void check_stops(Workbench& bench, const Faults& faults) {
  for (const auto& [line, reason] : faults) {
    CAPTURE(line);
    Process daemon(bench.daemon());
    require_running(daemon, bench);
    bench.plant().write_line(line);
    CHECK(daemon.wait() == 1);
    INFO(daemon.err() << bench.plant().err());
    const std::string::size_type stopped = daemon.err().find("stopped: ");
    REQUIRE(stopped != std::string::npos);
    CHECK(daemon.err().find(reason, stopped) != std::string::npos);
    bench.plant().write_line("clear");
  }
}

using Question = std::function<bool(const hal::Frame&)>;

/// Listens to some frames of a bus from now on, also while nobody asks for them.
class Ear {
 public:
  /// @param wanted  identifiers; so few of their frames come that they find room until they are asked for
  Ear(const std::string& interface, const std::vector<uint32_t>& wanted)
      : bus_(hal::open_bus(interface, hal::BusRole::kJoin, wanted)) {}

  /// Waits until each question has had a frame that answers it with yes.
  /// @return  false where patience was at an end before
  bool hears(std::vector<Question> questions) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience_s);
    while (!questions.empty() && std::chrono::steady_clock::now() < deadline) {
      for (hal::Frame frame; bus_->receive(frame);) {
        last_ = hal::to_text(frame);
        std::erase_if(questions, [&](const Question& question) { return question(frame); });
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (!questions.empty())
      UNSCOPED_INFO(questions.size() << " of the frames waited for did not come; the last one was '" << last_
                                     << "'");
    return questions.empty();
  }

 private:
  std::unique_ptr<hal::Bus> bus_;
  std::string last_;
};

/// Kills the daemon while it runs: every drive must stop by itself, and the next daemon start.
/// @param told     identifiers of the frames in which drives say so
/// @param stopped  whether a frame says that a drive has; one question a drive
void check_death(Workbench& bench, const std::vector<uint32_t>& told, const std::vector<Question>& stopped) {
  Process daemon(bench.daemon());
  require_running(daemon, bench);
  Ear ear(bench.bus(), told);
  daemon.send(SIGKILL);
  CHECK(daemon.wait() == -SIGKILL);
  CHECK(ear.hears(stopped));
  const Ended next = run(bench.daemon({"--duration", "1"}));
  INFO(next.err << bench.plant().err());
  CHECK(next.code == 0);
}

TEST_CASE("What befalls CiA 402 drives and their controller stops the robot with the reason", "[vcan]") {
  if (skipped()) return;
  const OwnInterface interface;
  Workbench bench(kSoonMissed, interface.name());
  check_stops(bench, {{"fault left emcy 0x2310", "'left' (node 2): drive fault"},
                      {"heartbeat left off", "'left' (node 2): heartbeat lost"},
                      {"bus off", "lost"}});
  const auto master_lost = [](int node) {
    return [node](const hal::Frame& frame) {
      constexpr uint16_t kMasterLost = 0x8130;
      const auto emergency = hal::decode_emergency(frame, node);
      return emergency && emergency->code == kMasterLost;
    };
  };
  check_death(bench, {hal::kEmergencyBase + 1, hal::kEmergencyBase + 2}, {master_lost(1), master_lost(2)});
}

TEST_CASE("What befalls ODrive axes and their controller stops the robot with the reason", "[vcan]") {
  if (skipped()) return;
  struct Row {
    std::string name;
    hal::OdriveFirmware firmware;
    Faults faults;  // that look the same to both are shown with one
  };
  const Row row = GENERATE(Row{"0.5",
                               hal::OdriveFirmware::k0_5,
                               {{"fault left error 0x40", "'left' (node 2): drive fault: motor failed"}}},
                           Row{"0.6",
                               hal::OdriveFirmware::k0_6,
                               {{"fault left error 0x40", "'left' (node 2): drive fault: missing input"},
                                {"heartbeat left off", "'left' (node 2): heartbeat lost"},
                                {"bus off", "lost"}}});
  CAPTURE(row.name);
  const OwnInterface interface;
  Changes changes = kSoonMissed;
  const Changes axes = odrive(row.name);
  changes.insert(changes.end(), axes.begin(), axes.end());
  Workbench bench(changes, interface.name());
  check_stops(bench, row.faults);
  const auto watchdog = [firmware = row.firmware](int node) {
    return [=](const hal::Frame& frame) {
      const auto heartbeat = hal::decode_odrive_heartbeat(frame, node, firmware);
      return heartbeat && heartbeat->axis_error == hal::odrive_watchdog_error(firmware);
    };
  };
  constexpr auto kHeartbeat = hal::OdriveMessage::kHeartbeat;
  check_death(bench, {hal::odrive_id(1, kHeartbeat), hal::odrive_id(2, kHeartbeat)},
              {watchdog(1), watchdog(2)});
}

TEST_CASE("An axis that is stuck stops the robot with what was commanded and what is measured", "[vcan]") {
  if (skipped()) return;
  const OwnInterface interface;
  Changes changes = GENERATE(Changes{}, odrive("0.6"));
  for (int axis = 0; axis < 2; ++axis)
    changes.emplace_back("pulley_radius: 5 mm}", "pulley_radius: 5 mm, following_error: 0.5 mm}");
  changes.emplace_back("speed: 10 mm/s", "speed: 2 mm/s");  // a stall of a second is nothing
  Workbench bench(changes, interface.name());
  check_stops(bench, {{"stuck left", "'left' (node 2): axis does not follow: commanded "}});
}

TEST_CASE("A robot goes on through noise, delay, lost frames and a cut cable, not without a required sensor",
          "[vcan]") {
  if (skipped()) return;
  const OwnInterface interface;
  Workbench bench(
      {{"timeout: 100 ms", "timeout: 2 s"}, {"timeout: 50 ms", "timeout: 10 s\n    on_loss: stop"}},
      interface.name());
  Process daemon(bench.daemon());
  require_running(daemon, bench);
  Ear load_cells(interface.name(), {0x1F1});
  bench.plant().write_line("noise 2 N");
  CHECK(load_cells.hears({[](const hal::Frame& frame) {  // a cable that pushes
    const hal::Signal tension{.name = "", .length = 16, .type = hal::SignalType::kSigned};
    return frame.id == 0x1F1 && hal::decode(tension, frame).value_or(0) < -1000;
  }}));
  for (const char* line : {"delay 5 ms", "drop 10 %", "cut left"}) {
    bench.plant().write_line(line);
    CHECK(bench.plant().says(std::string("injected: ") + line));
  }
  bench.plant().write_line("sensor camera off");
  CHECK(daemon.says("[warning] sensor 'camera': no sample"));
  bench.plant().write_line("clear");
  CHECK(daemon.says("[info] sensor 'camera' is back"));
  CHECK_FALSE(daemon.wait(0));
  bench.plant().write_line("sensor load_cells off");
  CHECK(daemon.wait() == 1);
  INFO(daemon.err() << bench.plant().err());
  CHECK(daemon.err().find("stopped: sensor 'load_cells': no sample younger than 10000 ms") !=
        std::string::npos);
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
