// SPDX-License-Identifier: Apache-2.0
#include "app/jog/jog_run.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/config/config.h"
#include "app/config/config_error.h"
#include "app/config/load_config.h"
#include "app/config/master_config.h"
#include "app/config/utf8.h"
#include "app/jog/jog.h"
#include "app/program/output.h"
#include "app/program/real_time_rights.h"
#include "app/program/stop_signal.h"
#include "app/robot/robot.h"
#include "hal/bus/bus_lock.h"
#include "hal/bus/open_bus.h"
#include "hal/drive/drive_protocol.h"
#include "hal/drive/supervisor.h"
#include "rt/channels.h"
#include "rt/control_loop.h"
#include "rt/control_thread.h"

namespace tendril::app {
namespace {

constexpr auto kTick = std::chrono::milliseconds(10);
constexpr int64_t kPrintInterval_ns = 200'000'000;

std::size_t index_of(const Config& config, const std::string& name) {
  std::string known;
  for (std::size_t a = 0; a < config.actuators.size(); ++a) {
    if (config.actuators[a].name == name) return a;
    known += (known.empty() ? "" : ", ") + config.actuators[a].name;
  }
  throw ConfigError(fmt::format("{}: has no actuator '{}'; it has {}", config.file.string(), name, known));
}

/// The drives of the configuration without all but one.
hal::MasterConfig only_axis(hal::MasterConfig config, std::size_t actuator) {
  config.axes = {config.axes[actuator]};
  // A jog moves to positions, whatever the axis follows otherwise.
  config.axes[0].set_point = hal::SetPoint::kDisplacement;
  return config;
}

/// Prints how the axis moves while the control thread runs.
class JogDisplay {
 public:
  /// @param print  else records are only taken
  JogDisplay(rt::TraceRing& trace, const ActuatorConfig& actuator, bool print)
      : trace_(trace), unit_(displacement_unit(actuator)), print_(print) {}

  /// Takes the records that have come.
  void drain() {
    rt::TraceRecord record;
    while (trace_.pop(record)) {
      measured_ = record.measured[0];
      if (first_ns_ == 0) first_ns_ = record.intended_ns;
      if (!print_ || record.intended_ns < due_ns_ || !takes_a_line(STDOUT_FILENO)) continue;
      due_ns_ = record.intended_ns + kPrintInterval_ns;
      fmt::print("{:6.1f} s  {:8} commanded {:9.3f} {}  measured {:9.3f} {}\n",
                 1e-9 * static_cast<double>(record.intended_ns - first_ns_), rt::name(record.phase),
                 unit_.per_si * record.command[0], unit_.name, unit_.per_si * measured_, unit_.name);
      std::fflush(stdout);
    }
  }

  double measured() const { return measured_; }  ///< last displacement, m or m³

 private:
  rt::TraceRing& trace_;
  hal::DisplacementUnit unit_;
  bool print_;
  int64_t first_ns_ = 0, due_ns_ = 0;
  double measured_ = 0;
};

/// What became of it, in a sentence.
std::string verdict(const Jog& jog, const hal::DriveMaster& master, const ActuatorConfig& actuator,
                    double measured) {
  const hal::DisplacementUnit unit = displacement_unit(actuator);
  switch (jog.ending()) {
    case Jog::Ending::kArrived:
      return fmt::format("'{}' went from {:.3f} to {:.3f} {}, as its drive says", actuator.name,
                         unit.per_si * jog.start(), unit.per_si * measured, unit.name);
    case Jog::Ending::kStopped:
      return fmt::format("stopped at {:.3f} {}", unit.per_si * measured, unit.name);
    case Jog::Ending::kBeyond:
      return fmt::format(
          "'{}' stands at {:.3f} {}, and its limits are {:g} to {:g} {}: it was not moved; is its "
          "reference right?",
          actuator.name, unit.per_si * jog.start(), unit.name, unit.per_si * actuator.displacement_min,
          unit.per_si * actuator.displacement_max, unit.name);
    case Jog::Ending::kStrayed:
      return fmt::format(
          "'{}' was found at {:.3f} {} where {:.3f} {} was commanded, and was disabled: does it "
          "move at all, the right way, and as far as counts and pulley say?",
          actuator.name, unit.per_si * measured, unit.name, unit.per_si * jog.commanded(), unit.name);
    case Jog::Ending::kDriveFault:
      return master.describe(jog.drive_fault());
  }
  return "";
}

}  // namespace

int run_jog(const JogOptions& options) {
  const Config config = load_config(options.file);
  const std::size_t index = index_of(config, options.actuator);
  const ActuatorConfig& actuator = config.actuators[index];
  Jog jog(jog_config(options, actuator, 1 / config.control.rate_hz));
  lock_memory(options.allow_non_rt);
  const hal::MasterConfig drives = only_axis(master_config(config), index);
  const auto master = hal::make_master(drives);
  const std::string& bus_name = options.bus.empty() ? config.bus.name : options.bus;
  const hal::BusLock lock(bus_name);
  const auto bus = hal::open_bus(bus_name, hal::BusRole::kJoin, master->identifiers());
  bus->limit_waiting(hal::kWaitingCycles * hal::frames_in_cycle(1));
  const auto channels = std::make_unique<rt::Channels>();
  rt::ControlLoop loop(*bus, *master, jog, *channels);
  JogDisplay display(channels->trace, actuator, !options.json);
  rt::ControlThread control({"jog", config.control.priority, config.control.cpu},
                            rights_of(options.allow_non_rt), config.control.rate_hz, loop, *channels);
  if (!control.refusal().empty()) spdlog::warn("{}", control.refusal());
  while (!control.ended()) {
    std::this_thread::sleep_for(kTick);
    if (stop_signalled()) channels->requests.stop = true;
    display.drain();
  }
  control.join();
  display.drain();

  const std::string power = hal::describe_power(drives, loop.measurement());
  const bool arrived = jog.ending() == Jog::Ending::kArrived && power.empty();
  const double measured = display.measured();
  const std::string text = verdict(jog, *master, actuator, measured) + (power.empty() ? "" : "; " + power);
  if (options.json)
    fmt::print("{}\n", to_text(nlohmann::ordered_json{{"actuator", actuator.name},
                                                      {"arrived", arrived},
                                                      {"start", jog.start()},
                                                      {"commanded", jog.commanded()},
                                                      {"measured", measured},
                                                      {"verdict", text}}));
  else
    fmt::print("{}\n", text);
  return arrived ? 0 : 1;
}

}  // namespace tendril::app
