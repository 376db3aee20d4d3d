// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <poll.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <optional>
#include <thread>

#include "app/config/load_config.h"
#include "app/plant/plant.h"
#include "app/plant/plant_console.h"
#include "app/program/command_line.h"
#include "app/program/exit_codes.h"
#include "app/program/program.h"
#include "app/program/stop_signal.h"
#include "hal/bus/open_bus.h"
#include "hal/drive/drive_protocol.h"
#include "rt/periodic_clock.h"
#include "rt/spsc_ring.h"
#include "rt/thread.h"
#include "rt/triple_buffer.h"

namespace tendril::app {
namespace {

// Below the controller's: drives answer within a period, but never at its expense.
constexpr int kBusPriority = 40;
constexpr int kPollTimeout_ms = 1;
// After a pause of the whole machine the body does not try to catch up.
constexpr double kLongestStep_s = 0.1;
constexpr int kStopPoll_ms = 20;

using FaultRing = rt::SpscRing<PlantFault, 64>;  // main thread ▶ bus thread

/// Moves the body in step with the clock until told to quit. Where a step takes longer than the time it
/// stands for, the next one covers all that has passed: the body becomes coarser in time, but never slower.
/// What it does to the drives is told after every step.
/// @return  share of the grid's deadlines that were passed over; nothing where the body could not be advanced
std::optional<double> run_body(PlantBody& body, rt::TripleBuffer<PlantDisplacements>& displacements,
                               rt::TripleBuffer<PlantEfforts>& efforts,
                               rt::TripleBuffer<PlantMeasurement>& measurements,
                               const std::atomic<bool>& quit) {
  int64_t then_ns = rt::now_ns(), steps = 0, missed = 0;
  rt::PeriodicClock clock(1e9 / static_cast<double>(body.time_step_ns()), then_ns);
  while (!quit) {
    const int64_t now_ns = clock.wait();
    if (!body.step(displacements.latest(),
                   std::min(kLongestStep_s, 1e-9 * static_cast<double>(now_ns - then_ns)))) {
      spdlog::error("the simulated body could not be advanced: a smaller plant.time_step may help");
      return std::nullopt;
    }
    then_ns = now_ns;
    efforts.back() = body.efforts();
    efforts.publish();
    measurements.back() = body.measurement(now_ns);
    measurements.publish();
    ++steps;
    missed += clock.realign(rt::now_ns());
  }
  return static_cast<double>(missed) / static_cast<double>(std::max<int64_t>(1, steps + missed));
}

void run_bus(hal::Bus& bus, PlantDrives& drives, rt::TripleBuffer<PlantDisplacements>& displacements,
             rt::TripleBuffer<PlantEfforts>& efforts, rt::TripleBuffer<PlantMeasurement>& measurements,
             FaultRing& faults, const std::atomic<bool>& quit) noexcept {
  PlantFault fault;
  pollfd readable{bus.descriptor(), POLLIN, 0};
  while (!quit) {
    poll(&readable, 1, kPollTimeout_ms);
    while (faults.pop(fault)) drives.inject(fault);
    drives.set_loads(efforts.latest());
    drives.serve(bus, measurements.latest(), rt::now_ns());
    displacements.back() = drives.body_displacements();
    displacements.publish();
  }
}

int print_data_sheet(const std::string& file) {
  const hal::DriveProtocol& protocol = *load_config(file).bus.master.protocol;
  if (protocol.data_sheet().empty())
    throw ConfigError(
        fmt::format("--eds: found bus.protocol {} in {}, expected a protocol whose drives have an "
                    "electronic data sheet",
                    protocol.name(), file));
  fmt::print("{}", protocol.data_sheet());
  return kOk;
}

int run_plant(const std::string& file, const std::string& bus_name) {
  std::optional<ExitOnStopSignal> starting(std::in_place);
  const Config config = load_config(file);
  PlantBody body(config);
  PlantDrives drives(config);
  starting.reset();
  const auto bus = hal::open_bus(bus_name.empty() ? config.bus.name : bus_name, hal::BusRole::kHost);
  rt::TripleBuffer<PlantDisplacements> displacements;
  rt::TripleBuffer<PlantEfforts> efforts;
  rt::TripleBuffer<PlantMeasurement> measurements;
  FaultRing faults;
  PlantConsole console(config);
  std::atomic<bool> quit{false};
  displacements.back() = drives.body_displacements();
  displacements.publish();
  measurements.back() = body.measurement(rt::now_ns());
  measurements.publish();

  rt::RealtimeThread bus_thread({"bus", kBusPriority}, rt::RtRights::kIgnore, [&] {
    run_bus(*bus, drives, displacements, efforts, measurements, faults, quit);
  });
  std::optional<double> behind;
  std::atomic<bool> body_ended{false};
  std::thread body_thread([&] {
    behind = run_body(body, displacements, efforts, measurements, quit);
    body_ended = true;
  });
  spdlog::info("{}: simulated robot of {} nodes on {}", config.robot, body.robot().model.mesh().node_count(),
               bus->describe());
  fmt::print("ready\n");
  std::fflush(stdout);
  while (!stop_signalled() && !body_ended)
    for (const PlantFault& fault : console.read(kStopPoll_ms))
      if (!faults.push(fault)) spdlog::error("too many faults at once; the last one was not injected");
  quit = true;
  body_thread.join();
  bus_thread.join();
  if (!behind) return kCheckFailed;
  spdlog::info("ended; the body was too slow for {:.1f} % of its time steps and took longer ones instead",
               100 * *behind);
  return kOk;
}

}  // namespace
}  // namespace tendril::app

int main(int argc, char** argv) {
  using namespace tendril;
  app::CommandLine cli{
      "tendril-plant is a simulated robot on the other side of the bus: servo drives that speak the "
      "protocol of the robot file, a body in motion with a material of its own (section 'plant' of the robot "
      "file), and its sensors. "
      "Faults can be injected: a line on standard input for each; the line 'help' lists them. It hosts "
      "the bus where that is a local socket, and prints 'ready' once it can be talked to. Ends on "
      "SIGTERM.\n\n"
      "Exit codes: 0 ended as asked; 1 the body could not be advanced; 2 wrong usage or robot file; 3 the "
      "machine lacks something (bus)."};
  std::string file, bus;
  bool eds = false;
  cli.add("CONFIG", file, "the robot: a YAML file, see docs/robot-file.md").required();
  cli.add("--bus", bus, "CAN interface, or local:PATH; replaces bus.name of the file");
  cli.add_flag("--eds", eds, "print the electronic data sheet (EDS) of the simulated drives, and end");

  return app::run_program("tendril-plant", cli, argc, argv, [&] {
    if (eds) return app::print_data_sheet(file);
    app::watch_stop_signals();
    return app::run_plant(file, bus);
  });
}
