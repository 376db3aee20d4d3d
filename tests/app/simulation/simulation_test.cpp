// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "tests/app/program/programs.h"

namespace tendril::app::simulation_test {

struct Simulated {
  explicit Simulated(const Changes& changes, const std::vector<std::string>& more = {})
      : file(finger(changes)) {
    std::vector<std::string> command{kDaemon, file.path().string(), "--simulate",
                                     "2.05",  "--report",           report()};
    command.insert(command.end(), more.begin(), more.end());
    ended = run(without_pictures(command));
  }
  std::string report() const { return (file.folder() / "report").string(); }

  RobotFile file;
  Ended ended;
};

TEST_CASE("A simulated run leaves the record of a run, with the same numbers every time", "[scenario]") {
  const Simulated first({}), second({});
  INFO(first.ended.err);
  REQUIRE(first.ended.code == 0);
  CHECK_THAT(first.ended.out, Catch::Contains("2 s  run"));
  CHECK_THAT(first.ended.err,
             Catch::Contains("finger for 2.0 s in virtual time") && Catch::Contains("mm from its path"));
  const std::string trace = read_text_file(first.report() + "/trace.csv");
  CHECK(trace == read_text_file(second.report() + "/trace.csv"));
  const nlohmann::json summary = read_summary(first.report());
  CHECK(summary["duration_s"].get<double>() == Approx(2.05).margin(0.005));
  CHECK(summary["late_cycles"] == 0);
  CHECK(summary["model_refreshes"].get<int>() >= 120);
  CHECK(summary["tracking_error_mm"]["samples"].get<int>() > 50);
  // Each cycle stands once in the trace, on the grid of the control rate.
  const Trace rows = read_trace(first.report());
  for (std::size_t k = 1; k < rows.rows.size(); ++k)
    REQUIRE(rows.number(k, "t_s") - rows.number(k - 1, "t_s") == Approx(1.0 / 600).margin(2e-6));
}

TEST_CASE("The model of a simulated run is refreshed as often as asked for", "[scenario]") {
  const Simulated simulated({}, {"--model-rate", "25"});
  REQUIRE(simulated.ended.code == 0);
  const nlohmann::json summary = read_summary(simulated.report());
  CHECK(summary["model_rate_hz"] == 25);
  CHECK(summary["model_refreshes"].get<double>() ==
        Approx(2.05 * 25).margin(10));  // it also starts and stops
}

TEST_CASE("A fault of the plant ends a simulated run with exit code 1 and the reason", "[scenario]") {
  const Simulated simulated(
      Changes{{"  time_step: 5 ms\n",
               "  time_step: 5 ms\n  faults:\n    - {after: 1 s, inject: heartbeat left off}\n"}});
  INFO(simulated.ended.err);
  CHECK(simulated.ended.code == 1);
  CHECK_THAT(simulated.ended.err, Catch::Contains("stopped: ") && Catch::Contains("heartbeat lost"));
  CHECK(read_summary(simulated.report())["faults"].size() == 1);
}

TEST_CASE("Robot and report may lie in a folder whose name is no text", "[scenario]") {
  const RobotFile beside("");
  const auto folder = beside.folder() / "two words, 'quoted' \"twice\"\n\xFF";
  std::filesystem::create_directory(folder);
  const auto file = folder / "\xFE.yaml", report = folder / "report";
  std::ofstream(file) << finger();
  const Ended ended = run({kDaemon, file.string(), "--simulate", "0.1", "--report", report.string()});
  INFO(ended.err);
  CHECK(ended.code == 0);
  CHECK_THAT(read_summary(report).at("configuration").get<std::string>(),
             Catch::EndsWith("two words, 'quoted' \"twice\"\n\uFFFD/\uFFFD.yaml"));
  CHECK(read_trace(report).rows.size() > 10);
  if (ended.err.find("no pictures") == std::string::npos)
    CHECK(std::filesystem::exists(report / "report.html"));
  else
    WARN("skipped: pictures, as there is no python3-matplotlib");
}

TEST_CASE("Without a simulated body there is nothing to simulate", "[unit]") {
  std::string text = finger();
  text.erase(text.find("plant:"));
  const RobotFile file(text);
  const Ended ended = run({kDaemon, file.path().string(), "--simulate", "1"});
  CHECK(ended.code == 2);
  CHECK_THAT(ended.err, Catch::Contains("plant"));
  CHECK(run({kDaemon, file.path().string(), "--simulate", "0"}).code == 2);
  CHECK(run({kDaemon, file.path().string(), "--model-rate", "5"}).code == 2);
}

}  // namespace tendril::app::simulation_test
