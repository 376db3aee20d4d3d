// SPDX-License-Identifier: Apache-2.0
#include "tests/app/plant/faults.h"

#include <catch2/catch.hpp>
#include <csignal>

#include "hal/canopen/canopen.h"
#include "hal/canopen/emergency.h"
#include "hal/odrive/odrive.h"
#include "hal/sensor/signal.h"

namespace tendril::app::faults_test {

/// Kills the daemon while it runs: every drive must stop by itself, and the next daemon start.
/// @param told     identifiers of the frames in which drives say so
/// @param stopped  whether a frame says that a drive has; one question a drive
void check_death(Workbench& bench, const std::vector<uint32_t>& told, const std::vector<Question>& stopped) {
  // Drives say it once, and a listener that the machine holds up for long misses it.
  bool heard = false;
  for (int attempt = 0; attempt < 3 && !heard; ++attempt) {
    Process daemon(bench.daemon());
    require_running(daemon, bench);
    Ear ear(bench.bus(), told);
    daemon.send(SIGKILL);
    CHECK(daemon.wait() == -SIGKILL);
    heard = ear.hears(stopped);
  }
  CHECK(heard);
  const Ended next = run(bench.daemon({"--duration", "1"}));
  INFO(next.err << bench.plant().err());
  CHECK(next.code == 0);
}

TEST_CASE("What befalls CiA 402 drives and their controller stops the robot with the reason", "[scenario]") {
  Workbench bench(kSoonMissed);
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

TEST_CASE("What befalls ODrive axes and their controller stops the robot with the reason", "[scenario]") {
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
  Changes changes = kSoonMissed;
  const Changes axes = odrive(row.name);
  changes.insert(changes.end(), axes.begin(), axes.end());
  Workbench bench(changes);
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

TEST_CASE("An axis that is stuck stops the robot with what was commanded and what is measured",
          "[scenario]") {
  Changes changes = GENERATE(Changes{}, odrive("0.6"));
  // Where the machine stalls, the axis that is not stuck lags behind its command, too.
  for (const char* limit : {"1 m", "0.5 mm"})
    changes.emplace_back("pulley_radius: 5 mm}",
                         std::string("pulley_radius: 5 mm, following_error: ") + limit + "}");
  changes.emplace_back("speed: 10 mm/s", "speed: 2 mm/s");  // a stall of a second is nothing
  Workbench bench(changes);
  check_stops(bench, {{"stuck left", "'left' (node 2): axis does not follow: commanded "}});
}

TEST_CASE("A robot goes on through noise, delay, lost frames and a cut cable, not without a required sensor",
          "[scenario]") {
  Workbench bench(
      Changes{{"timeout: 100 ms", "timeout: 2 s"}, {"timeout: 50 ms", "timeout: 10 s\n    on_loss: stop"}});
  Process daemon(bench.daemon());
  require_running(daemon, bench);
  Ear load_cells(bench.bus(), {0x1F1});
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

}  // namespace tendril::app::faults_test
