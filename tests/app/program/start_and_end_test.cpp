// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/app/daemon/bus_listener.h"
#include "tests/app/program/finger.h"
#include "tests/app/program/programs.h"

// tendrild and tendril-plant as programs that start, end and die beside each other.

namespace tendril::app::start_and_end_test {

constexpr uint16_t kMasterLost = 0x8130;  // CiA 301: life guard or heartbeat error
constexpr hal::ObjectAddress kStatusword{0x6041, 0}, kPosition{0x6064, 0}, kWatchedMaster{0x1016, 1};
constexpr double kPrinted_m = 1e-7;  // resolution of lengths in the trace
// How far the search for the zero goes past the switch while the machine stalls: at the speed below it takes
// 4 s for this.
constexpr double kPastSwitch_m = 0.2e-3;

// The finger bends to one side and stays there.
const Changes kBend{{"waypoints: [5 0 0 mm, -5 0 0 mm]", "waypoints: [5 0 0 mm]"}};

/// Both.
Changes operator+(Changes some, const Changes& others) {
  some.insert(some.end(), others.begin(), others.end());
  return some;
}

/// The finger is bent: a controller that ended here has left something to take over.
bool bent(const Heard& heard) {
  const auto right = heard.feedback.find(1);
  return right != heard.feedback.end() && std::abs(right->second.position) * kCount_m > 0.5e-3;
}

/// The state that a drive answers when it is asked.
std::optional<hal::DriveState> state(BusListener& listener, int node) {
  const auto statusword = listener.read(node, kStatusword);
  if (!statusword) return std::nullopt;
  return hal::decode_statusword(static_cast<uint16_t>(*statusword));
}

/// The cable that a drive answers to have wound up, m.
double length_m(BusListener& listener, int node) {
  return kCount_m * static_cast<int32_t>(listener.read(node, kPosition).value_or(0));
}

/// A trace begins where the drives stand: held to a count while they are enabled, left no faster than the
/// top speed allows afterwards.
void check_holds_at_first(const Trace& trace, const std::map<int, double>& lengths_m) {
  int enabling = 0;
  std::size_t row = 0;
  for (; row < trace.rows.size() && trace.cell(row, "phase") != "approach"; ++row) {
    if (trace.cell(row, "phase") != "enable") continue;
    ++enabling;
    for (const int node : kNodes) {
      const std::string& cable = kCables[node - 1];
      CHECK(std::abs(trace.number(row, "command_" + cable + "_m") - lengths_m.at(node)) <
            kCount_m + kPrinted_m);
      CHECK(std::abs(trace.number(row, "displacement_" + cable + "_m") - lengths_m.at(node)) <
            kCount_m + kPrinted_m);
    }
  }
  CHECK(enabling > 0);
  REQUIRE(row < trace.rows.size());
  for (const int node : kNodes) {
    const double command = trace.number(row, "command_" + kCables[node - 1] + "_m");
    CHECK(std::abs(command - lengths_m.at(node)) < kTopSpeed * kPeriod + kCount_m + kPrinted_m);
  }
}

TEST_CASE("A robot whose axes find their reference at switches is homed, and then runs", "[scenario]") {
  const std::string right = "node: 1, counts_per_turn: 65536", left = "node: 2, counts_per_turn: 65536";
  const std::string homing =
      ", reference: homing, homing: {method: 17, speed_search: 2000, speed_zero: 100}, offset: -1 mm";
  const Workbench bench({{right, right + homing}, {left, left + homing}});
  const Ended ended =
      run(without_pictures(bench.daemon({"--duration", "2", "--report", bench.report().string()})));
  INFO(ended.err);
  REQUIRE(ended.code == 0);
  const Trace trace = read_trace(bench.report());
  REQUIRE_FALSE(trace.of({"enable"}).empty());
  const std::size_t enabled = trace.of({"enable"}).front();
  std::map<int, double> lengths;
  for (const int node : kNodes) {
    lengths[node] = trace.number(enabled, "displacement_" + kCables[node - 1] + "_m");
    CHECK(lengths[node] == Approx(-1e-3).margin(kPastSwitch_m));
  }
  check_holds_at_first(trace, lengths);
}

TEST_CASE("SIGTERM ends the daemon with disabled drives, and the next one takes over without a jump",
          "[scenario]") {
  Workbench bench(kBend);
  BusListener listener(bench.bus(), kNodes);
  Process daemon(bench.daemon());
  REQUIRE(listener.until(bent));
  daemon.send(SIGTERM);
  const auto code = daemon.wait();
  INFO(daemon.err());
  CHECK(code == 0);

  REQUIRE_FALSE(bench.plant().wait(0));
  std::map<int, double> lengths;
  for (const int node : kNodes) {
    CHECK(state(listener, node) == hal::DriveState::kSwitchOnDisabled);
    CHECK(listener.read(node, kWatchedMaster) == 0u);  // or it would miss our heartbeat
    lengths[node] = length_m(listener, node);
  }
  CHECK(std::abs(lengths[1]) > 0.4e-3);
  CHECK(listener.heard().emergencies.empty());

  const Ended next =
      run(without_pictures(bench.daemon({"--duration", "0.2", "--report", bench.report().string()})));
  INFO(next.err);
  REQUIRE(next.code == 0);
  check_holds_at_first(read_trace(bench.report()), lengths);
  CHECK(listener.heard().emergencies.empty());
}

TEST_CASE("SIGKILL of the daemon stops the drives by themselves, and a new one can start", "[scenario]") {
  Workbench bench(kBend + kSoonMissed);
  BusListener listener(bench.bus(), kNodes);
  {
    Process daemon(bench.daemon());
    REQUIRE(listener.until(bent));
    const Heard heard = listener.heard();
    for (const int node : kNodes)
      CHECK(hal::decode_statusword(heard.feedback.at(node).statusword) == hal::DriveState::kEnabled);
    daemon.send(SIGKILL);
    CHECK(daemon.wait() == -SIGKILL);
  }
  for (const int node : kNodes) {
    INFO("node " << node);
    REQUIRE(listener.until([node](const Heard& heard) { return heard.emergencies.contains(node); }));
    CHECK(listener.heard().emergencies.at(node) == std::vector{kMasterLost});
    CHECK(state(listener, node) == hal::DriveState::kFault);
    const auto where = listener.read(node, kPosition);
    REQUIRE(where);
    REQUIRE(listener.until_more(kCamera, 5));  // 50 ms of the plant's time
    CHECK(listener.read(node, kPosition) == where);
  }

  const Ended next = run(bench.daemon({"--duration", "0.2"}));
  INFO(next.err);
  CHECK(next.code == 0);
  for (const int node : kNodes) {  // code 0: the former master's fault is cleared, and no other came
    REQUIRE(listener.until([node](const Heard& heard) { return heard.emergencies.at(node).size() > 1; }));
    CHECK(listener.heard().emergencies.at(node) == std::vector<uint16_t>{kMasterLost, 0});
  }
}

TEST_CASE("Beside a running daemon a second one and a jog send nothing, and the first goes on",
          "[scenario]") {
  // Whoever comes later listens for four heartbeats: on a stalling machine, too, the first is then heard.
  Workbench bench(Changes{{"heartbeat: 50 ms", "heartbeat: 1 s"}});
  BusListener listener(bench.bus(), kNodes);
  Process first(bench.daemon());
  REQUIRE(first.says("phase: run"));
  // As from another machine, whose lock of the bus is another one: under another name of the same socket.
  const std::string socket = bench.bus().substr(bench.bus().find(':') + 1), elsewhere = socket + "2";
  std::filesystem::create_hard_link(socket, elsewhere);
  for (auto command : {bench.daemon(), bench.jog("left", {"--by", "1 mm"})}) {
    const Ended refused = run(command);
    INFO(refused.out << refused.err);
    CHECK(refused.code == 3);
    CHECK_THAT(refused.err, Catch::Contains("another tendrild or tendrilctl (process ") &&
                                Catch::Contains("controls its drives"));

    std::replace(command.begin(), command.end(), bench.bus(), "local:" + elsewhere);
    const Ended later = run(command);
    INFO(later.out << later.err);
    CHECK(later.code == 1);
    CHECK_THAT(later.out + later.err, Catch::Contains("another controller commands these drives") &&
                                          !Catch::Contains("drives disabled"));
  }
  CHECK_FALSE(first.wait(0));
  first.send(SIGTERM);
  CHECK(first.wait() == 0);
  INFO(first.err());
  CHECK_THAT(first.err(), Catch::Contains("drives disabled"));
  for (const int node : kNodes) CHECK(listener.read(node, kWatchedMaster) == 0u);
}

TEST_CASE("SIGKILL of the plant ends the daemon with exit code 1 and one line that says why", "[scenario]") {
  Workbench bench(kBend);
  BusListener listener(bench.bus(), kNodes);
  Process daemon(bench.daemon());
  REQUIRE(listener.until(bent));
  bench.plant().send(SIGKILL);
  CHECK(daemon.wait() == 1);
  std::vector<std::string> errors = lines_of(daemon.err());
  std::erase_if(errors, [](const std::string& line) { return line.find("[error]") == std::string::npos; });
  INFO(daemon.err());
  REQUIRE(errors.size() == 1);
  CHECK_THAT(errors[0], Catch::Contains("stopped: ") && Catch::Contains("bus"));
}

TEST_CASE("SIGTERM ends the plant with exit code 0, with and without a controller", "[scenario]") {
  Workbench bench;
  const bool with_controller = GENERATE(false, true);
  CAPTURE(with_controller);
  std::optional<Process> daemon;
  if (with_controller) {
    daemon.emplace(bench.daemon());
    REQUIRE(daemon->says("phase: run"));
  }
  bench.plant().send(SIGTERM);
  CHECK(bench.plant().wait() == 0);
  if (daemon) CHECK(daemon->wait() == 1);
}

}  // namespace tendril::app::start_and_end_test
