// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstdlib>
#include <optional>

#include "app/check/check_report.h"
#include "app/config/load_config.h"
#include "app/daemon/daemon.h"
#include "app/program/command_line.h"
#include "app/program/exit_codes.h"
#include "app/program/program.h"
#include "app/program/report_pictures.h"
#include "app/program/stop_signal.h"
#include "app/robot/body.h"
#include "app/robot/bus_check.h"
#include "app/robot/robot_geometry.h"
#include "app/simulation/simulation.h"

int main(int argc, char** argv) {
  using namespace tendril;
  app::CommandLine cli{
      "tendrild controls a soft robot in real time: a background thread keeps a finite-element model of the "
      "body up to "
      "date, a control thread solves the inverse problem on the newest snapshot at every period and sends "
      "displacements "
      "to servo drives over CAN. Ends on SIGTERM with the drives disabled.\n\n"
      "Exit codes: 0 ended as asked; 1 ended on a fault, or a check failed; 2 wrong usage or robot file; 3 "
      "the machine "
      "lacks something (rights, bus)."};
  std::string file;
  std::filesystem::path picture;
  bool check = false, json = false, dbc = false;
  std::optional<double> simulated_s, model_rate_hz;
  app::DaemonOptions options;
  cli.add("CONFIG", file, "the robot: a YAML file, see docs/robot-file.md").required();
  cli.add("--bus", options.bus, "CAN interface, or local:PATH; replaces bus.name of the file");
  cli.add("--duration", options.duration_s, "seconds to run once the drives are enabled; 0: until a signal")
      .not_negative();
  cli.add("--report", options.report, "folder for figures, trace and pictures of the run");
  cli.add("--log", options.log,
          "record every cycle, sample, target and event into FILE.mcap, for Foxglove, PlotJuggler and "
          "tools/report; older ones become FILE.1.mcap and so on (default: under systemd, the robot's name "
          "in /var/lib/tendril; else none)")
      .ending_in({".mcap"});
  cli.add("--log-size", options.log_size_mb,
          "MB that all files of the log take at the most; the oldest go first (default: 1000)")
      .within(64.0, 1e6);
  cli.add("--metrics", options.metrics,
          "answer Prometheus at this address and port, e.g. 127.0.0.1:9477; a port alone is for programs on "
          "this machine only");
  cli.add("--socket", options.socket,
          "where operators and their programs connect, a UNIX socket (default: under systemd, the robot's "
          "name in "
          "/run/tendril; else none)");
  cli.add_flag(
      "--allow-non-rt", options.allow_non_rt,
      "run without SCHED_FIFO and locked memory where they are refused; for trying out, not for a robot");
  cli.add_flag("--check", check, "verify everything that needs no bus, say what was found, and end");
  cli.add_flag("--dbc", dbc, "print a DBC file of every frame of this robot's bus, for CAN tools, and end")
      .excludes("--check");
  cli.add("--simulate", simulated_s,
          "run robot and simulated body for so many seconds of virtual time, as fast as this machine can, "
          "with the same "
          "numbers on every run, and end; takes no bus")
      .within(0.1, 1e6)
      .excludes("--check")
      .excludes("--dbc")
      .excludes("--bus")
      .excludes("--duration")
      .excludes("--log")
      .excludes("--metrics")
      .excludes("--socket");
  cli.add("--model-rate", model_rate_hz, "with --simulate: refreshes of the model a second (default: 60)")
      .needs("--simulate")
      .within(1.0, 10'000.0);
  cli.add("--picture", picture, "with --check: draw the robot into this file, .png, .svg or .html")
      .ending_in({".png", ".svg", ".html"})
      .needs("--check");
  cli.add_flag("--json", json, "with --check: one line of JSON").needs("--check");

  return app::run_program("tendrild", cli, argc, argv, [&] {
    if (!check && !dbc) app::watch_stop_signals();
    const app::Config config = app::load_config(file);
    if (dbc) {
      fmt::print("{}", app::bus_dbc(config));
      return static_cast<int>(app::kOk);
    }
    if (simulated_s) return app::simulate(config, {*simulated_s, model_rate_hz.value_or(60), options.report});
    if (const char* folder = std::getenv("RUNTIME_DIRECTORY"); folder && options.socket.empty())
      options.socket = std::filesystem::path(folder) / (config.file.stem().string() + ".sock");
    if (const char* folder = std::getenv("STATE_DIRECTORY"); folder && options.log.empty())
      options.log = std::filesystem::path(folder) / (config.file.stem().string() + ".mcap");
    // Before the check, since it is most wanted where something does not hold.
    if (!picture.empty()) app::draw_robot(app::robot_geometry(config, app::load_mesh(config)), picture);
    return check ? app::check_robot(config, json) : app::run_daemon(config, options);
  });
}
