// SPDX-License-Identifier: Apache-2.0
// The experiments of Largilliere et al. (2015), section IV, in virtual time; each prints one JSON object.
// tools/reproduce runs them and makes a page of what they print.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/config/load_config.h"
#include "app/robot/inverse_statics.h"
#include "tools/coupling_variation.h"
#include "tools/path_run.h"

namespace tendril::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPaperRate = 15;  // Hz, of the paper's model
// What a model of this size is refreshed at on a core of the machine that docs/model.md was measured on:
// fixed, so that the figures do not depend on the machine. tools/reproduce measures the real rate as well.
constexpr double kOurRate = 480;       // Hz
constexpr double kJitter = 0.5;        // of the period
constexpr double kLimit = 0.10;        // the change of ‖W_eaᵀW_ea‖∞ that the paper accepts
constexpr double kLineLength = 25e-3;  // m
// m, ways of the tip between two snapshots; the paper's longest is 10 mm.
constexpr double kShortestStep = 0.4e-3, kLongestStep = 10e-3;
constexpr double kRounds = 2;

constexpr auto kExact = fem::Tangent::kExact, kSemidefinite = fem::Tangent::kSemidefinite;

// mm/s: the paper's, then more.
const std::vector<double> kLineSpeeds{6.25, 12.5,  25,  37.5, 50,  62.5, 75,  87.5,
                                      100,  112.5, 125, 150,  200, 300,  400, 600};

double mm(double metres) { return 1e3 * metres; }

/// To 0.1 µm: a series is for a picture.
double coarse_mm(double metres) { return std::round(1e7 * metres) / 1e4; }

double coarse_s(double seconds) { return std::round(1e6 * seconds) / 1e6; }

void progress(int done, int all, const std::string& what) {
  fmt::print(stderr, "{}/{} {}\n", done, all, what);
}

Json json(const Loops& loops) {
  return {{"loops", loops.synchronous ? 1 : 2},
          {"model_rate_hz", loops.model_rate_hz},
          {"jitter", loops.jitter},
          {"tangent", loops.tangent == kExact ? "exact" : "semidefinite"}};
}

Json head(const app::Config& config, const char* experiment) {
  const auto robot = app::build_model(config);
  const Eigen::Vector3d rest = 1e3 * app::effectors_at_rest(*robot).head<3>();
  return {{"experiment", experiment},
          {"robot", config.robot},
          {"nodes", robot->model.mesh().node_count()},
          {"tetrahedra", robot->model.mesh().tet_count()},
          {"control_rate_hz", config.control.rate_hz},
          {"tip_at_rest_mm", {rest.x(), rest.y(), rest.z()}}};
}

/// Loops to try on a line, and whether they stand in the table, with every speed of the paper.
std::vector<std::pair<Loops, bool>> loops_on_line() {
  std::vector<std::pair<Loops, bool>> all;
  for (const auto tangent : {kSemidefinite, kExact})
    for (const double rate : {7.5, kPaperRate, 30.0, 60.0})
      all.push_back({{rate, true, 0, tangent}, rate == kPaperRate});
  all.push_back({{kPaperRate, false, 0, kSemidefinite}, true});
  all.push_back({{kPaperRate, false, 0, kExact}, true});
  all.push_back({{kOurRate, false, 0, kExact}, true});
  return all;
}

/// The largest changes at all speeds that are worth it.
Json curve(const app::Config& config, const Eigen::Vector3d& direction, const Loops& loops, bool in_table) {
  std::vector<double> speeds, percent;
  for (const double speed : kLineSpeeds) {
    const double step = 1e-3 * speed / loops.model_rate_hz;
    if (step > kLongestStep || (step < kShortestStep && !in_table)) continue;
    speeds.push_back(speed);
    percent.push_back(100 * variation_on_line(config, kLineLength * direction, 1e-3 * speed, loops).largest);
  }
  Json result = json(loops);
  result["speed_mm_s"] = speeds;
  result["largest_change_percent"] = percent;
  result["speed_at_limit_mm_s"] = speed_at(100 * kLimit, speeds, percent);  // null where it is not reached
  return result;
}

/// The table of section IV, for two lines and several loops.
Json variation(const app::Config& config) {
  const std::vector<std::pair<const char*, Eigen::Vector3d>> lines{{"upwards", Eigen::Vector3d::UnitZ()},
                                                                   {"sideways", Eigen::Vector3d::UnitX()}};
  const auto all = loops_on_line();
  Json result = head(config, "variation");
  result["line_length_mm"] = mm(kLineLength);
  result["limit_percent"] = 100 * kLimit;
  int done = 0;
  for (const auto& [name, direction] : lines) {
    Json line{{"line", name}, {"curves", Json::array()}};
    for (const auto& [loops, in_table] : all) {
      progress(done++, static_cast<int>(lines.size() * all.size()),
               fmt::format("{}, model at {} Hz", name, loops.model_rate_hz));
      line["curves"].push_back(curve(config, direction, loops, in_table));
    }
    result["lines"].push_back(line);
  }
  return result;
}

Json figures(const PathRun& run) {
  const Errors errors = run.errors();
  return {{"error_mm", {{"mean", mm(errors.mean)}, {"p95", mm(errors.p95)}, {"max", mm(errors.max)}}},
          {"roughness_mm_s2", mm(run.roughness())}};
}

Json series(const PathRun& run) {
  Json seen{{"t_s", Json::array()}, {"tip_mm", Json::array()}, {"desired_mm", Json::array()}};
  for (const PathRun::Seen& sample : run.seen) {
    seen["t_s"].push_back(coarse_s(sample.t));
    for (const auto& [key, point] :
         {std::pair("tip_mm", sample.tip), std::pair("desired_mm", sample.desired)})
      seen[key].push_back({coarse_mm(point.x()), coarse_mm(point.y()), coarse_mm(point.z())});
  }
  Json sent{{"t_s", Json::array()}, {"displacement_mm", Json::array()}};
  for (const PathRun::Sent& command : run.sent) {
    sent["t_s"].push_back(coarse_s(command.t));
    sent["displacement_mm"].push_back(coarse_mm(command.displacement.front()));
  }
  return {{"seen", seen}, {"sent", sent}};
}

/// Figures 4 to 6: the robot's own path at its own speed.
Json square(const app::Config& config) {
  const std::vector<Loops> all{{kPaperRate, true},
                               {kPaperRate, true, kJitter},
                               {kPaperRate, true, 0, kSemidefinite},
                               {kPaperRate, false},
                               {kPaperRate, false, kJitter},
                               {kPaperRate, false, 0, kSemidefinite},
                               {kOurRate, true},
                               {kOurRate, false}};
  Json result = head(config, "square");
  result["speed_mm_s"] = mm(config.motion->speed);
  result["rounds"] = kRounds;
  result["actuator"] = config.actuators.front().name;
  result["jitter_seed"] = app::VirtualSettings{}.jitter_seed;
  for (std::size_t k = 0; k < all.size(); ++k) {
    progress(static_cast<int>(k), static_cast<int>(all.size()),
             fmt::format("{}, model at {} Hz", all[k].synchronous ? "one loop" : "two loops",
                         all[k].model_rate_hz));
    const PathRun run = run_path(config, config.motion->speed, kRounds, all[k]);
    Json entry = json(all[k]);
    entry.update(figures(run));
    entry["series"] = series(run);
    result["runs"].push_back(entry);
  }
  return result;
}

/// The square once round, at several speeds and model rates.
Json map(const app::Config& config) {
  const std::vector<double> speeds{25, 50, 75, 100}, rates{7.5, kPaperRate, 30, 60, kOurRate};
  const std::vector<Loops> kinds{{0, true}, {0, false}, {0, false, 0, kSemidefinite}};
  Json result = head(config, "map");
  int done = 0;
  for (Loops loops : kinds)
    for (const double rate : rates)
      for (const double speed : speeds) {
        loops.model_rate_hz = rate;
        progress(done++, static_cast<int>(kinds.size() * rates.size() * speeds.size()),
                 fmt::format("{} mm/s, model at {} Hz", speed, rate));
        Json entry = json(loops);
        entry["speed_mm_s"] = speed;
        entry.update(figures(run_path(config, 1e-3 * speed, 1, loops)));
        result["runs"].push_back(entry);
      }
  return result;
}

}  // namespace
}  // namespace tendril::tools

int main(int argc, char** argv) {
  using tendril::tools::Json;
  CLI::App app(
      "Repeats an experiment of Largilliere et al. (2015) in virtual time and prints its figures as JSON.\n"
      "tools/reproduce runs all of them and makes a page of it.");
  std::string experiment, robot;
  app.add_option(
         "EXPERIMENT", experiment,
         "variation: of the QP's matrix along a line; square: error and commands on the robot's path; "
         "map: the same at several speeds and model rates")
      ->required()
      ->check(CLI::IsMember({"variation", "square", "map"}));
  app.add_option("ROBOT", robot, "robot file, with a closed motion and a plant")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    const auto config = tendril::app::load_config(robot);
    const Json result = experiment == "variation" ? tendril::tools::variation(config)
                        : experiment == "square"  ? tendril::tools::square(config)
                                                  : tendril::tools::map(config);
    fmt::print("{}\n", result.dump());
  } catch (const tendril::app::ConfigError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "reproduction: {}\n", error.what());
    return 1;
  }
}
