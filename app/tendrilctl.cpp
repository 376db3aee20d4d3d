// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>
#include <vector>

#include "app/client/operate.h"
#include "app/jog/jog_run.h"
#include "app/program/command_line.h"
#include "app/program/program.h"
#include "app/program/stop_signal.h"

namespace tendril::app {
namespace {

/// Commands for the robot that a running daemon controls.
void declare_operation(CommandLine& cli, OperateOptions& options,
                       std::vector<std::pair<const char*, CommandLine*>>& commands) {
  const auto add = [&](const char* name, const std::string& description, bool moves) -> CommandLine& {
    CommandLine& command = cli.add_command(name, description);
    command.add("--socket", options.socket, "of the daemon (default: the only one in /run/tendril)");
    if (moves)
      command.add_flag("--steal", options.steal, "take the control away from the client that has it");
    commands.emplace_back(name, &command);
    return command;
  };
  CommandLine& status =
      add("status", "shows targets, model, sensors, actuators and faults of the running robot", false);
  status.add_flag("--watch", options.watch, "again and again, until Ctrl-C");
  status.add_flag("--json", options.json, "one line of JSON, in SI units");
  add("faults",
      "says what has stopped the robot, since when, and what to do; exit code 1 where there is a fault",
      false);
  CommandLine& monitor = add("monitor", "prints the state as it changes, until Ctrl-C", false);
  monitor.add("--rate", options.rate_hz, "states a second, up to the control rate (default: 10)")
      .within(0.1, 1000.0);
  monitor.add_flag("--json", options.json, "one line of JSON a state, in SI units");
  CommandLine& target =
      add("target",
          "moves the first effector to a point in a straight line, and waits until the target is "
          "there; Ctrl-C holds it on its way.\nExample: tendrilctl target 10 0 120 --speed 20",
          true);
  target.add("MM", options.position_mm, "one value a controlled coordinate, in the robot's frame").required();
  target.add("--speed", options.speed_mm_s, "mm/s (default: motion.speed of the robot file, else 50)")
      .within(0.001, 10'000.0);
  target.add("--in", options.in_s, "seconds for the way, instead of a speed")
      .within(0.0, 600.0)
      .excludes("--speed");
  CommandLine& play =
      add("play",
          "follows the path of the robot file from its beginning, or a trajectory: goes to its first point, "
          "then along it, and ends with it; Ctrl-C holds the robot where it is.\n"
          "Example: tendrilctl play circle.csv --loop --percent 50\n"
          "Example: tendrilctl play --shape circle --size 20 --speed 15 --turns 3",
          true);
  play.add("FILE", options.trajectory,
           "CSV with a header: t [s], then coordinates such as tip.x [mm]; without brackets in SI units");
  play.add("--shape", options.shape,
           "instead of a file: circle, square, line, eight or lissajous, around where the target is; with "
           "--size")
      .one_of({"circle", "square", "line", "eight", "lissajous"})
      .excludes("FILE");
  play.add("--size", options.size_mm, "of the shape: width and height in mm, or one value for both")
      .needs("--shape");
  play.add("--plane", options.plane, "of the shape: xy (default), yx, xz, zx, yz or zy")
      .one_of({"xy", "yx", "xz", "zx", "yz", "zy"})
      .needs("--shape");
  play.add("--centre", options.centre_mm, "of the shape: two values in mm, in its plane").needs("--shape");
  play.add("--speed", options.speed_mm_s, "along the shape, mm/s (default: 20)")
      .within(0.001, 10'000.0)
      .needs("--shape");
  play.add("--turns", options.turns, "of the shape (default: 1)").within(1, 1000).needs("--shape");
  play.add_flag("--loop", options.loop, "again and again, until Ctrl-C");
  play.add("--percent", options.percent, "of the speed of the trajectory (default: 100)").within(0.1, 1000.0);
  add("pause", "lets time on the path stand still", true);
  add("resume", "goes on along the path", true);
  add("hold", "stays where the effectors are wanted now", true);
  add("speed", "sets how fast time passes on the path", true)
      .add("PERCENT", options.percent, "of the speed in the robot file, 0 to 100")
      .required()
      .within(0.0, 100.0);
  add("disable",
      "brings the robot to a halt, whoever has the control, and disables its drives; the daemon goes on "
      "watching them",
      false);
  add("enable", "enables the drives again, where they stand; the robot holds there", true);
  add("reset",
      "after a fault: takes note of it and enables the drives again, where they stand; the robot holds "
      "there. Remove the "
      "cause first, see tendrilctl faults",
      true);
  add("stop", "ends the run, whoever has the control: the robot comes to a halt and its drives are disabled",
      false);
}

}  // namespace
}  // namespace tendril::app

int main(int argc, char** argv) {
  using namespace tendril;
  app::CommandLine cli{
      "tendrilctl is for the hands of whoever wires and runs the robot. All commands but jog speak to a "
      "running "
      "tendrild over its control socket.\n\n"
      "Exit codes: 0 done; 1 it ended otherwise than asked; 2 wrong usage or robot file; 3 the machine lacks "
      "something (rights, bus, a daemon)."};
  app::OperateOptions operation;
  std::vector<std::pair<const char*, app::CommandLine*>> commands;
  app::declare_operation(cli, operation, commands);
  app::JogOptions jog;
  app::CommandLine& command = cli.add_command(
      "jog",
      "moves one axis by a small way and lets go of it: the first careful motion of a drive. No model, no "
      "daemon (stop it first: one master a bus), no other drive takes part. The motion stays within the "
      "limits "
      "of the robot file; the axis is disabled where it strays from its command, where its drive reports a "
      "fault, and on Ctrl-C.\n"
      "Example: tendrilctl jog config/diamond.yaml north --by '2 mm' --speed '1 mm/s'");
  command.add("CONFIG", jog.file, "the robot: a YAML file, see docs/robot-file.md").required();
  command.add("ACTUATOR", jog.actuator, "its name in the robot file").required();
  command
      .add("--by", jog.by,
           "how far from where it stands: '2 mm', '-1 mm', or '0.5 ml' for a pump; positive shortens a "
           "cable, lengthens a rod, fills a cavity")
      .required();
  command.add("--speed", jog.speed, "how fast (default: a hundredth of the actuator's top speed)");
  command.add("--limit", jog.limit, "the farthest that --by may go (default: 5 mm, or 5 ml)");
  command.add("--lag", jog.lag, "how far from its command the axis may be found (default: 1 mm, or 1 ml)");
  command.add("--bus", jog.bus, "CAN interface, or local:PATH; replaces bus.name of the file");
  command.add_flag("--json", jog.json, "one line of JSON instead of progress");
  command.add_flag("--allow-non-rt", jog.allow_non_rt,
                   "run without SCHED_FIFO and locked memory where they are refused");

  return app::run_program("tendrilctl", cli, argc, argv, [&] {
    app::watch_stop_signals();
    for (const auto& [name, given] : commands)
      if (given->given()) {
        operation.command = name;
        return app::operate(operation);
      }
    return app::run_jog(jog);
  });
}
