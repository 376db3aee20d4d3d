#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <limits>
#include <numbers>
#include <optional>

#include "tests/app/daemon/bus_listener.h"
#include "tests/app/program/programs.h"

// tendrild and tendril-plant as programs that start, end and die beside each other.

namespace tendril::app::process_test {

constexpr uint16_t kMasterLost = 0x8130;  // CiA 301: life guard or heartbeat error
constexpr hal::ObjectAddress kStatusword{0x6041, 0}, kPosition{0x6064, 0}, kWatchedMaster{0x1016, 1};
constexpr double kCount_m = 2 * std::numbers::pi * 0.005 / 65536;  // of the finger's encoders
constexpr double kTopSpeed = 0.03, kPeriod = 1 / 200.0;            // m/s and s on the workbench
constexpr double kPrinted_m = 1e-7;                                // resolution of lengths in the trace
// How far the search for the zero goes past the switch while the machine stalls: at the speed below it takes
// 4 s for this.
constexpr double kPastSwitch_m = 0.2e-3;
constexpr uint32_t kCamera = 0x1F0, kSync = 0x080;  // come by the plant's clock and the daemon's
const std::vector<int> kNodes{1, 2};
const std::string kCables[] = {"right", "left"};

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

/// True once the finger has gone to its first waypoint and some way to the next: it is on its path.
class Turned {
 public:
  bool operator()(const Heard& heard) {
    const auto right = heard.command.find(1);
    if (right == heard.command.end()) return false;
    const double command_m = right->second.target * kCount_m;
    farthest_m_ = std::max(farthest_m_, command_m);
    return farthest_m_ > 0.5e-3 && command_m < farthest_m_ - 0.2e-3;
  }

 private:
  double farthest_m_ = -std::numeric_limits<double>::infinity();
};

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

void check_summary(const nlohmann::json& summary, const std::string& bus) {
  INFO(summary.dump(2));
  CHECK(summary.at("robot") == "finger");
  CHECK(summary.at("nodes") == 342);
  CHECK(summary.at("tetrahedra") == 1100);
  CHECK(summary.at("actuators") == 2);
  CHECK(summary.at("effector_dofs") == 1);
  CHECK(summary.at("bus") == "local bus at " + bus.substr(std::string("local:").size()));
  CHECK(summary.at("control_rate_hz") == 1 / kPeriod);
  CHECK(summary.at("late_cycles") >= 0);
  CHECK(summary.at("model_refreshes") > 0);
  CHECK(summary.at("model_rate_hz") > 0);
  for (const char* key : {"mean", "p95", "max"}) CHECK(summary.at("tracking_error_mm").at(key) >= 0);
  for (const char* key : {"mean", "max"}) CHECK(summary.at("model_error_mm").at(key) >= 0);
  CHECK(summary.at("qp").at("iterations_max") > 0);
  CHECK(summary.at("qp").at("iterations_max") <= summary.at("qp").at("cap"));
  CHECK(summary.at("qp").at("cap") >= 8);  // 4 an actuator; how many more the machine decides
  CHECK(summary.at("qp").at("cap") <= 32);
  CHECK(summary.at("qp").at("statuses").at("optimal") > 0);
  const nlohmann::json& rt = summary.at("rt");
  CHECK(rt.at("policy").is_string());
  CHECK(rt.at("priority").is_number_integer());
  CHECK(rt.at("memory_locked").is_boolean());
  CHECK(rt.at("major_faults").is_number_integer());
#ifdef TENDRIL_SANITIZED
  CHECK(rt.at("heap_calls") == -1);  // the sanitizers' malloc is not counted
#else
  CHECK(rt.at("heap_calls") == 0);
#endif
  CHECK(summary.at("faults") == nlohmann::json::array());
  CHECK(summary.at("warnings") == nlohmann::json::array());
}

void check_trace(const Trace& trace, const nlohmann::json& summary) {
  CHECK(trace.columns == std::vector<std::string>{"t_s",
                                                  "phase",
                                                  "target_x_m",
                                                  "target_y_m",
                                                  "target_z_m",
                                                  "model_x_m",
                                                  "model_y_m",
                                                  "model_z_m",
                                                  "measured_x_m",
                                                  "measured_y_m",
                                                  "measured_z_m",
                                                  "measured_t_s",
                                                  "command_right_m",
                                                  "displacement_right_m",
                                                  "effort_right_N",
                                                  "measured_right_N",
                                                  "command_left_m",
                                                  "displacement_left_m",
                                                  "effort_left_N",
                                                  "measured_left_N",
                                                  "qp_status",
                                                  "qp_iterations",
                                                  "snapshot_age_s",
                                                  "wakeup_us",
                                                  "cycle_us"});
  const int cycles = summary.at("cycles"), late = summary.at("late_cycles"),
            dropped = summary.at("trace_dropped");
  CHECK(static_cast<int>(trace.rows.size()) == cycles - late - dropped);
  bool forward = true;
  for (std::size_t row = 1; row < trace.rows.size(); ++row)
    forward = forward && trace.number(row, "t_s") > trace.number(row - 1, "t_s");
  CHECK(forward);
  const std::vector<std::size_t> running = trace.of({"approach", "run"});
  REQUIRE_FALSE(running.empty());
  const double duration_s = trace.number(running.back(), "t_s") - trace.number(running.front(), "t_s");
  CHECK(summary.at("duration_s").get<double>() == Approx(duration_s).margin(1e-3));
}

TEST_CASE("A run of two seconds ends with exit code 0, a whole report and no fault", "[scenario]") {
  const Workbench bench;
  const Ended ended = run(bench.daemon({"--duration", "2", "--report", bench.report().string()}));
  INFO(ended.err);
  REQUIRE(ended.code == 0);
  CHECK_THAT(ended.err,
             Catch::Contains("axis 0 'right' (node 1): tendril-plant, hardware simulated, software 1.0") &&
                 Catch::Contains("axis 1 'left' (node 2): tendril-plant"));
  const nlohmann::json summary = read_summary(bench.report());
  CHECK(summary.at("faults") == nlohmann::json::array());
  CHECK(summary.at("warnings") == nlohmann::json::array());
  CHECK(summary.at("cycles") >= 2 / kPeriod);  // deadlines, whether a stall made it miss them or not
  const auto geometry = nlohmann::json::parse(read_text_file(bench.report() / "robot.json"));
  CHECK(geometry.at("robot") == "finger");
  const Trace trace = read_trace(bench.report());
  check_trace(trace, summary);
  // From the first cycle that ran to the last of the stop, which comes when the time is up: a cycle that ran
  // so late need not be there, where the machine stalled.
  CHECK(trace.number(trace.rows.size() - 1, "t_s") -
            trace.number(trace.of({"approach", "run"}).front(), "t_s") >=
        2 - kPeriod);
}

TEST_CASE("A run that has gone along its path reports all of its phases and figures", "[scenario]") {
  Workbench bench;
  BusListener listener(bench.bus(), kNodes);
  Process daemon(without_pictures(bench.daemon({"--report", bench.report().string()})));
  REQUIRE(listener.until(Turned()));
  // What the camera has seen of the path is judged once the daemon has read it.
  REQUIRE(listener.until_more(kCamera, 20));
  REQUIRE(listener.until_more(kSync, 20));
  daemon.send(SIGTERM);
  const auto code = daemon.wait();
  INFO(daemon.err());
  REQUIRE(code == 0);
  const nlohmann::json summary = read_summary(bench.report());
  check_summary(summary, bench.bus());
  const Trace trace = read_trace(bench.report());
  check_trace(trace, summary);
  std::vector<std::string> phases;
  for (std::size_t row = 0; row < trace.rows.size(); ++row)
    if (phases.empty() || phases.back() != trace.cell(row, "phase"))
      phases.push_back(trace.cell(row, "phase"));
  CHECK(phases == std::vector<std::string>{"connect", "model", "enable", "approach", "run", "stop"});
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

}  // namespace tendril::app::process_test
