// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/daemon.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <optional>

#include "app/config/master_config.h"
#include "app/daemon/housekeeping.h"
#include "app/daemon/prepared_robot.h"
#include "app/daemon/run_recorder.h"
#include "app/daemon/service_manager.h"
#include "app/daemon/telemetry_log.h"
#include "app/daemon/telemetry_sink.h"
#include "app/program/real_time_rights.h"
#include "app/program/report_pictures.h"
#include "app/robot/bus_check.h"
#include "app/robot/control_stack.h"
#include "app/robot/model_thread.h"
#include "app/robot/robot.h"
#include "app/robot/robot_geometry.h"
#include "hal/bus/bus_lock.h"
#include "hal/bus/open_bus.h"
#include "hal/drive/drive_protocol.h"
#include "hal/drive/supervisor.h"
#include "rt/control_thread.h"

namespace tendril::app {
namespace {

constexpr auto kHousekeepingInterval = std::chrono::milliseconds(5);

void log_start(const Config& config, const hal::Bus& bus, const std::string& bus_name) {
  const size_t m = config.actuators.size();
  spdlog::info("{}: {} on {}", config.robot, m == 1 ? "one actuator" : fmt::format("{} actuators", m),
               bus.describe());
  for (const std::string& warning : warnings_on_drives(config)) spdlog::warn("{}", warning);
  if (const std::string warning = warning_on_queue(config, bus_name, bus.transmit_queue()); !warning.empty())
    spdlog::warn("{}", warning);
}

bool waits_after_fault(const Config& config, const DaemonOptions& options) {
  const OnFault on_fault = config.control.on_fault;
  if (on_fault == OnFault::kWait && options.socket.empty())
    throw ConfigError(fmt::format(
        "{}: control.on_fault is wait, and nobody could reset a fault: give --socket", config.file.string()));
  return on_fault == OnFault::kWait || (on_fault == OnFault::kWaitWhereReachable && !options.socket.empty());
}

}  // namespace

int run_daemon(const Config& config, const DaemonOptions& options) {
  check_bus(config);
  const bool waits = waits_after_fault(config, options);
  PreparedRobot prepared = prepare_robot(config, options.allow_non_rt);
  prepared.law.waits_after_fault = waits;
  const Robot& robot = *prepared.robot;
  std::optional<RunRecorder> recorder;
  if (!options.report.empty()) recorder.emplace(config, options.report);

  const hal::MasterConfig drives = master_config(config);
  auto master = hal::make_master(drives);
  const std::string& bus_name = options.bus.empty() ? config.bus.name : options.bus;
  const hal::BusLock lock(bus_name);
  const auto bus = hal::open_bus(bus_name, hal::BusRole::kJoin, master->identifiers());
  RunFacts facts;
  facts.nodes = robot.model.mesh().node_count();
  facts.tetrahedra = robot.model.mesh().tet_count();
  facts.bus = bus->describe();
  facts.memory_locked = prepared.memory_locked;
  facts.iteration_cap = prepared.law.iteration_cap;
  std::optional<TelemetryLog> log;
  std::optional<TelemetrySink> lines;
  if (!options.log.empty()) {
    log.emplace(config, options.log, static_cast<uint64_t>(1e6 * options.log_size_mb), facts);
    lines.emplace(*log);
    rt::keep_to_cpu(log->thread(), "log", config.control.housekeeping_cpu);
  }
  log_start(config, *bus, bus_name);
  ControlStack stack(prepared.law, std::move(master), *bus);
  ModelThread model(robot, config, *stack.channels);
  ServiceManager service;
  Housekeeping housekeeping(config, options, *stack.channels, model, *stack.master, prepared.rest,
                            recorder ? &*recorder : nullptr, log ? &*log : nullptr, service);
  housekeeping.show_body(robot, config);
  rt::ControlThread control({"control", config.control.priority, config.control.cpu},
                            rights_of(options.allow_non_rt), config.control.rate_hz, stack.loop,
                            *stack.channels);
  // Not before: threads are born with the CPUs of the one that makes them.
  rt::keep_to_cpu(pthread_self(), "housekeeping", config.control.housekeeping_cpu);
  if (!control.refusal().empty()) spdlog::warn("{}", control.refusal());
  while (!control.ended()) {
    housekeeping.run_once();
    housekeeping.wait(kHousekeepingInterval);
  }
  control.join();
  housekeeping.run_once();  // what came last
  model.stop();

  const rt::LoopCounts& counts = control.counts();
  std::string reason = stack.stop_reason(config);
  const hal::Measurement& last = stack.loop.measurement();
  const std::string power = hal::describe_power(drives, last);
  if (!power.empty()) reason += (reason.empty() ? "" : "; ") + power;
  if (!reason.empty()) {
    service.status("stopped: " + reason);
    spdlog::error("stopped: {}", reason);
  }
  if (power.empty() && last.fault.kind != hal::FaultKind::kOtherMaster) spdlog::info("drives disabled");
  spdlog::info("{} cycles, {} late, {:.3f} % on time; {} model refreshes, {} failed", counts.cycles,
               counts.late_cycles, 100 * counts.success_rate(), model.refreshes(), model.failures());
  facts.model_refreshes = model.refreshes();
  facts.model_rate_hz = model.mean_rate_hz();
  facts.trace_dropped = stack.channels->trace.dropped();
  facts.bus_dropped = bus->dropped();
  facts.stop_reason = reason;
  lines.reset();
  if (log) log->finish(housekeeping.progress(), facts, counts);
  if (recorder) {
    recorder->finish(facts, counts);
    recorder->add_geometry(robot_geometry(config, robot.model.mesh()));
    draw_report(options.report);
  }
  return reason.empty() ? 0 : 1;
}

}  // namespace tendril::app
