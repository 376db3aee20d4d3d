#include <spdlog/spdlog.h>

#include "app/jog/jog_run.h"
#include "app/program/command_line.h"
#include "app/program/exit_codes.h"
#include "app/program/output.h"
#include "app/program/stop_signal.h"

int main(int argc, char** argv) {
  using namespace tendril;
  app::open_standard_descriptors();
  app::CommandLine cli{
      "tendrilctl is for the hands of whoever wires and runs the robot.\n\n"
      "Exit codes: 0 done; 1 it ended otherwise than asked; 2 wrong usage or robot file; 3 the machine lacks "
      "something (rights, bus)."};
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
  if (const auto code = cli.parse(argc, argv)) return *code;

  app::log_to_stderr("tendrilctl");
  app::watch_stop_signals();
  return app::exit_code_of([&] { return app::run_jog(jog); });
}
