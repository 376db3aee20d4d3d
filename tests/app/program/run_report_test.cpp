// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/app/daemon/bus_listener.h"
#include "tests/app/program/finger.h"
#include "tests/app/program/programs.h"

// The report of a run of both programs.

namespace tendril::app::run_report_test {

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

}  // namespace tendril::app::run_report_test
