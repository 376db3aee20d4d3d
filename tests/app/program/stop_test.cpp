// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "tests/app/daemon/bus_listener.h"
#include "tests/app/program/finger.h"
#include "tests/app/program/programs.h"

// A stop that always stops: whenever it comes, whoever reads, whatever sleeps.

namespace tendril::app::stop_test {

constexpr hal::ObjectAddress kStatusword{0x6041, 0};

bool is_off(BusListener& listener, int node) {
  const auto word = listener.read(node, kStatusword);
  return word && hal::decode_statusword(static_cast<uint16_t>(*word)) != hal::DriveState::kEnabled;
}

/// Stops the daemon at random instants of its start and its run.
void stop_at_random_instants(int instants) {
  const auto seed = std::random_device{}();
  INFO("seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> instant_s(0, 1.2), pause_s(0, 0.01);
  Workbench bench;
  BusListener listener(bench.bus(), kNodes);
  for (int k = 0; k < instants; ++k) {
    const double after_s = instant_s(random);
    CAPTURE(k, after_s);
    std::filesystem::remove_all(bench.report());
    Process daemon(without_pictures(bench.daemon({"--report", bench.report().string()})));
    std::this_thread::sleep_for(std::chrono::duration<double>(after_s));
    daemon.send(SIGTERM);
    if (k % 2 == 1) {  // an impatient one
      std::this_thread::sleep_for(std::chrono::duration<double>(pause_s(random)));
      daemon.send(SIGTERM);
    }
    const auto code = daemon.wait();
    INFO(daemon.err());
    // Before main it is the system's own: no drive is touched then either.
    CHECK((code == 0 || (code == -SIGTERM && daemon.err().empty())));
    for (const int node : kNodes) CHECK(is_off(listener, node));
    if (code != 0 || daemon.err().find("stopped while starting") != std::string::npos) continue;
    CHECK(read_summary(bench.report()).at("faults").empty());  // the report is whole
    CHECK_NOTHROW(read_trace(bench.report()));
  }
}

TEST_CASE("A stop at any instant, once or twice, ends the daemon with its drives off", "[scenario][stops]") {
  const char* instants = std::getenv("TENDRIL_STOPS");
  stop_at_random_instants(instants ? std::stoi(instants) : 12);
}

TEST_CASE("A daemon whose log nobody reads stops all the same, with its drives off", "[scenario]") {
  Workbench bench;
  BusListener listener(bench.bus(), kNodes);
  // stderr is a pipe that is full, and that nobody reads.
  int ends[2];
  REQUIRE(::pipe2(ends, O_CLOEXEC) == 0);
  REQUIRE(::fcntl(ends[1], F_SETFL, O_NONBLOCK) == 0);
  const std::string filler(512, '-');
  while (::write(ends[1], filler.data(), filler.size()) > 0) {
  }
  REQUIRE(::fcntl(ends[1], F_SETFL, 0) == 0);
  const std::string pipe = "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(ends[1]);
  std::vector<std::string> shell{"bash", "-c", "exec \"$@\" 2>" + pipe, "bash"};
  for (const std::string& word : bench.daemon()) shell.push_back(word);
  Process daemon(shell);
  REQUIRE(listener.until([](const Heard& heard) {
    const auto feedback = heard.feedback.find(1);
    return feedback != heard.feedback.end() &&
           hal::decode_statusword(feedback->second.statusword) == hal::DriveState::kEnabled;
  }));
  daemon.send(SIGTERM);
  CHECK(daemon.wait() == 0);
  for (const int node : kNodes) CHECK(is_off(listener, node));
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST_CASE("Standard descriptors that are closed at the start take nothing else in their place",
          "[scenario]") {
  Workbench bench;
  std::vector<std::string> shell{"bash", "-c", "exec \"$@\" <&- >&- 2>&-", "bash"};
  for (const std::string& word :
       without_pictures(bench.daemon({"--duration", "0.3", "--report", bench.report().string()})))
    shell.push_back(word);
  const Ended ended = run(shell);
  CHECK(ended.code == 0);
  CHECK(read_summary(bench.report()).at("faults").empty());
  CHECK(read_trace(bench.report()).rows.size() > 10);  // and not a line of log among them
}

TEST_CASE("A model that rests for a quarter of an hour between refreshes is ended at once", "[scenario]") {
  Workbench bench(
      Changes{{"rate: 600 Hz", "rate: 200 Hz\n  iteration_cap: 32\n  model_rate_limit: 0.001 Hz"}});
  const Ended ended = run(bench.daemon({"--duration", "0.3"}));
  INFO(ended.err);
  CHECK(ended.code == 0);
}

TEST_CASE("A signal while the pictures are drawn ends the drawing, and nothing else of the report",
          "[scenario]") {
  Workbench bench;
  // Python that says that it has begun, and goes on for as long as the daemon lives.
  const auto begun = bench.folder() / "begun";
  std::ofstream(bench.folder() / "sitecustomize.py")
      << "import os, time\nopen('" << begun.string() << "', 'w').write(str(os.getpid()))\n"
      << "parent = os.getppid()\nwhile os.getppid() == parent: time.sleep(0.1)\n";
  const bool by_signal = GENERATE(true, false);
  std::vector<std::string> command{"env", "PYTHONPATH=" + bench.folder().string()};
  std::vector<std::string> more{"--report", bench.report().string()};
  if (!by_signal) more.insert(more.end(), {"--duration", "0.3"});
  for (const std::string& word : bench.daemon(more)) command.push_back(word);
  Process daemon(command);
  if (by_signal) {
    REQUIRE(daemon.says("phase: run"));
    daemon.send(SIGTERM);
  }
  REQUIRE(tendril::testing::comes_true(
      [&] { return std::filesystem::exists(begun) && std::filesystem::file_size(begun) > 0; }));
  daemon.send(SIGINT);
  CHECK(daemon.wait() == 0);
  INFO(daemon.err());
  CHECK_THAT(daemon.err(), Catch::Contains("no pictures: a signal ended the drawing") &&
                               Catch::Contains("this draws them: ") &&
                               Catch::Contains("report " + bench.report().string()));
  CHECK(read_summary(bench.report()).at("faults").empty());
  CHECK(read_trace(bench.report()).rows.size() > 10);
  CHECK_FALSE(std::filesystem::exists("/proc/" + read_text_file(begun)));  // nobody goes on drawing
}

TEST_CASE("Under nohup a hang-up ends nothing", "[scenario]") {
  Workbench bench;
  std::vector<std::string> command{"nohup"};
  for (const std::string& word : bench.daemon()) command.push_back(word);
  Process daemon(command);
  REQUIRE(daemon.says("phase: run"));
  daemon.send(SIGHUP);
  BusListener listener(bench.bus(), kNodes);
  REQUIRE(listener.until_more(0x080, 50));  // it goes on
  CHECK_FALSE(daemon.wait(0));
  daemon.send(SIGTERM);
  CHECK(daemon.wait() == 0);
}

}  // namespace tendril::app::stop_test
