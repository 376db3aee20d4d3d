// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <csignal>
#include <string>
#include <vector>

#include "tests/app/program/programs.h"

// What both programs say while they run, and what the simulated robot is told.

namespace tendril::app::log_and_console_test {

TEST_CASE("The journal gets lines with a priority, without a time of ours and without progress",
          "[scenario]") {
  Workbench bench;
  // As under systemd, which tells a service the file behind its stdout and stderr.
  std::vector<std::string> shell{
      "bash", "-c", "JOURNAL_STREAM=$(stat -L -c %d:%i /proc/self/fd/2) exec \"$@\" 1>&2", "bash"};
  for (const std::string& word : bench.daemon({"--duration", "1.5"})) shell.push_back(word);
  const Ended ended = run(shell);
  INFO(ended.err);
  CHECK(ended.code == 0);
  for (const std::string& line : lines_of(ended.err)) {
    CAPTURE(line);
    CHECK((line.starts_with("<6>") || line.starts_with("<4>")));
    CHECK(line.find("[tendrild]") == std::string::npos);
  }
  CHECK_THAT(ended.err, Catch::Contains("<6>phase: run\n"));
  CHECK_THAT(run(bench.daemon({"--duration", "1.5"})).out, Catch::Contains("run       error"));  // elsewhere
}

TEST_CASE("Faults are injected by a line on the plant's standard input, and a mistake in one is explained",
          "[scenario]") {
  Workbench bench(kSoonMissed);
  bench.plant().write_line("help");
  CHECK(bench.plant().says("heartbeat AXIS off"));
  bench.plant().write_line("stuck middle");
  CHECK(bench.plant().says("found 'stuck middle', expected the name of an actuator (right, left)"));
  Process daemon(bench.daemon());
  REQUIRE(daemon.says("phase: run"));
  bench.plant().write_line("heartbeat left off");
  CHECK(bench.plant().says("injected: heartbeat left off"));
  CHECK(daemon.wait() == 1);
  INFO(daemon.err() << bench.plant().err());
  CHECK(daemon.err().find("'left' (node 2): heartbeat lost") != std::string::npos);

  bench.plant().write_line("clear");
  CHECK(bench.plant().says("injected: clear"));
  const Ended next = run(bench.daemon({"--duration", "1"}));
  INFO(next.err);
  CHECK(next.code == 0);
}

TEST_CASE("The log tells when a sensor is lost and when it is back, and the robot goes on", "[scenario]") {
  Workbench bench;
  Process daemon(bench.daemon());
  REQUIRE(daemon.says("phase: run"));
  bench.plant().write_line("sensor camera off");
  CHECK(daemon.says("[warning] sensor 'camera': no sample younger than 100 ms"));
  bench.plant().write_line("clear");
  CHECK(daemon.says("[info] sensor 'camera' is back after"));
  daemon.send(SIGTERM);
  CHECK(daemon.wait() == 0);
}

TEST_CASE("A sensor that may not be lost ends the run with exit code 1 and its name", "[scenario]") {
  Workbench bench(Changes{{"timeout: 50 ms", "timeout: 10 s\n    on_loss: stop"}});
  Process daemon(bench.daemon());
  REQUIRE(daemon.says("phase: run"));
  bench.plant().write_line("sensor load_cells off");
  CHECK(daemon.wait() == 1);
  INFO(daemon.err());
  CHECK(daemon.err().find("stopped: sensor 'load_cells': no sample younger than 10000 ms") !=
        std::string::npos);
}

}  // namespace tendril::app::log_and_console_test
