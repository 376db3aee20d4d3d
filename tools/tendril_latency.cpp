// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include "app/config/load_config.h"
#include "app/config/utf8.h"
#include "app/program/command_line.h"
#include "app/program/exit_codes.h"
#include "app/program/program.h"
#include "app/program/report_pictures.h"
#include "app/program/stop_signal.h"
#include "rt/deadline_grid.h"
#include "tools/tendril_latency_load.h"
#include "tools/tendril_latency_machine.h"
#include "tools/tendril_latency_run.h"

namespace tendril::tools {
namespace {

using nlohmann::ordered_json;

constexpr const char* kResult = "latency.json";

struct Arguments {
  std::string robot;
  bool timer = false, json = false;
  LatencyOptions run;
  std::optional<double> rate_hz, model_rate;  // what is not given is the robot file's, or its default
  std::optional<int> priority, cpu, others_cpu;
  int load_cpu = -1;
  std::vector<std::string> loads, limits;
  std::filesystem::path report;
};

/// A threshold: that share of a stage's latencies, in percent, may not exceed so many us.
struct Limit {
  std::string stage;
  double percent, us;
};

app::ConfigError usage(const std::string& text) { return app::ConfigError(text + "; see --help"); }

bool read_number(const std::string& text, double& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

Limit parse_limit(const std::string& text) {
  const auto refuse = [&] {
    return usage(fmt::format(
        "--limit: found '{}', expected STAGE:PERCENT:US as in wakeup:99.9:100, with a stage of {}", text,
        fmt::join(LatencyStages::kNames, ", ")));
  };
  Limit limit;
  const auto first = text.find(':'), second = text.find(':', first + 1);
  if (first == std::string::npos || second == std::string::npos) throw refuse();
  limit.stage = text.substr(0, first);
  const std::string percent = text.substr(first + 1, second - first - 1), us = text.substr(second + 1);
  if (std::ranges::find(LatencyStages::kNames, limit.stage) == LatencyStages::kNames.end() ||
      !read_number(percent, limit.percent) || !read_number(us, limit.us) ||
      !(limit.percent >= 0 && limit.percent <= 100) || !(limit.us >= 0))
    throw refuse();
  return limit;
}

ordered_json judge(const std::vector<Limit>& limits, const LatencyStages& stages) {
  ordered_json verdicts = ordered_json::array();
  for (const Limit& limit : limits) {
    const rt::Histogram& stage = stages.stage(limit.stage);
    const double found_us = 1e-3 * static_cast<double>(stage.percentile_ns(limit.percent));
    verdicts.push_back({{"stage", limit.stage},
                        {"percent", limit.percent},
                        {"limit_us", limit.us},
                        {"found_us", found_us},
                        {"met", stage.count() > 0 && found_us <= limit.us}});
  }
  return verdicts;
}

ordered_json result_of(const Arguments& arguments, const LatencyStages& stages, const LatencyFacts& facts,
                       const ordered_json& verdicts) {
  ordered_json result;
  result["what"] = arguments.timer ? "timer" : arguments.robot;
  result["rate_hz"] = arguments.run.rate_hz;
  result["seconds"] = facts.seconds;
  result["cycles"] = stages.cycles();
  result["late"] = stages.late();
  result["trace_dropped"] = facts.trace_dropped;
  result["scheduling"] = facts.scheduling;
  for (const auto& [name, cpu] : {std::pair{"cpu", arguments.run.cpu},
                                  {"model_cpu", arguments.run.model_cpu},
                                  {"housekeeping_cpu", arguments.run.housekeeping_cpu},
                                  {"load_cpu", arguments.load_cpu}})
    result[name] = cpu < 0 ? ordered_json(nullptr) : ordered_json(cpu);
  result["memory_locked"] = facts.memory_locked;
  result["idle_latency_held"] = facts.idle_latency_held;
  for (const auto& [name, count] :
       {std::pair{"heap_calls", facts.heap_calls}, {"page_faults", facts.page_faults}})
    result[name] = count ? ordered_json(*count) : ordered_json(nullptr);
  result["model_rate_hz"] = facts.model_rate_hz;
  if (!arguments.timer) result["bus"] = arguments.run.bus.empty() ? "local" : arguments.run.bus;
  result["load"] = arguments.loads;
  result["problems"] = facts.problems;
  result["limits"] = verdicts;
  result["machine"] = describe_machine(arguments.run.cpu);
  result["stages"] = stages.json();
  return result;
}

void print_for_people(const Arguments& arguments, const LatencyStages& stages, const ordered_json& result) {
  const ordered_json& machine = result["machine"];
  fmt::print("{}{} at {:g} Hz for {:.1f} s, {}, load: {}\n", result["what"].get<std::string>(),
             arguments.run.bus.empty() ? "" : " on " + arguments.run.bus, arguments.run.rate_hz,
             result["seconds"].get<double>(), result["scheduling"].get<std::string>(),
             arguments.loads.empty() ? "none of ours" : fmt::format("{}", fmt::join(arguments.loads, ", ")));
  const auto told = [&](const char* key) {
    return machine[key].is_string() ? machine[key].get<std::string>() : "not told";
  };
  fmt::print("kernel {}, {} CPUs{}\n", told("kernel"), machine["cpus"].get<long>(),
             machine["virtual_machine"].get<bool>() ? " of a virtual machine" : "");
  fmt::print(
      "preemption {}; isolated CPUs {}; the measured thread's: governor {}, CPUs of its core {}\n\n{}\n",
      told("preemption"), told("isolated_cpus").empty() ? "none" : told("isolated_cpus"), told("governor"),
      told("cpus_of_the_core"), stages.table());
  if (result["page_faults"].is_number())
    fmt::print(
        "the control thread took {} page faults and made {} heap calls\n\n",
        result["page_faults"].get<long>(),
        result["heap_calls"].is_number() ? fmt::to_string(result["heap_calls"].get<long>()) : "uncounted");
  fmt::print("{}", stages.plot("wakeup"));
  if (!arguments.timer) fmt::print("\n{}", stages.plot("whole"));
  for (const ordered_json& verdict : result["limits"])
    fmt::print("{} {}: {:g} % within {:.1f} us, {:g} allowed\n",
               verdict["met"].get<bool>() ? "met    " : "BROKEN ", verdict["stage"].get<std::string>(),
               verdict["percent"].get<double>(), verdict["found_us"].get<double>(),
               verdict["limit_us"].get<double>());
}

/// Before anything is measured: a run of hours must not end for want of a folder.
void make_folder(const std::filesystem::path& folder) {
  std::error_code refused;  // which the file below meets, too
  std::filesystem::create_directories(folder, refused);
  if (!std::ofstream(folder / kResult, std::ios::app))  // an earlier result stays until there is a new one
    throw usage(fmt::format("--report: {} cannot be written", (folder / kResult).string()));
}

void write_report(const std::filesystem::path& folder, const ordered_json& result) {
  std::ofstream file(folder / kResult);
  file << app::to_text(result) << '\n';
  file.close();
  if (!file) throw std::runtime_error((folder / kResult).string() + " cannot be written in full");
  app::draw_report(folder);
}

int measure(Arguments arguments) {
  if (arguments.timer != arguments.robot.empty())
    throw usage(arguments.timer ? "either a robot file or --timer, not both"
                                : "a robot file or --timer is needed");
  if (arguments.timer && !arguments.run.bus.empty()) throw usage("--bus: --timer has no bus");
  std::vector<Limit> limits;
  for (const std::string& text : arguments.limits) {
    limits.push_back(parse_limit(text));
    if (const auto& stage = limits.back().stage; arguments.timer && stage != "wakeup" && stage != "whole")
      throw usage("--limit: --timer has no stage " + stage);
  }
  app::Config config;
  if (!arguments.timer) config = app::load_config(arguments.robot);
  const app::ControlConfig& control = config.control;
  arguments.run.rate_hz = arguments.rate_hz.value_or(control.rate_hz);
  arguments.run.model_rate_limit = arguments.model_rate.value_or(control.model_rate_limit_hz);
  arguments.run.priority = arguments.priority.value_or(control.priority);
  arguments.run.cpu = arguments.cpu.value_or(control.cpu);
  arguments.run.model_cpu = arguments.others_cpu.value_or(control.model_cpu);
  arguments.run.housekeeping_cpu = arguments.others_cpu.value_or(control.housekeeping_cpu);
  if (!arguments.report.empty()) make_folder(arguments.report);

  const auto stages = std::make_unique<LatencyStages>(std::llround(1e9 / arguments.run.rate_hz));
  const TellProgress tell = [&](double seconds) {
    fmt::print(stderr,
               "{:6.0f} s  {:10} cycles  late {}  99.9 %: wake-up {:.0f}, whole {:.0f} us  max {:.0f} us\n",
               seconds, stages->cycles(), stages->late(),
               1e-3 * static_cast<double>(stages->stage("wakeup").percentile_ns(99.9)),
               1e-3 * static_cast<double>(stages->stage("whole").percentile_ns(99.9)),
               1e-3 * static_cast<double>(stages->stage("whole").max_ns()));
  };
  LatencyFacts facts;
  {
    LatencyLoad load(arguments.loads, arguments.load_cpu);
    facts = arguments.timer ? run_timer(arguments.run, *stages, tell)
                            : run_robot(config, arguments.run, *stages, tell);
    if (!load.alive())
      facts.problems.push_back("stress-ng ended by itself: the load was not there all the time");
  }
  if (facts.trace_dropped > 0)
    facts.problems.push_back(
        fmt::format("{} cycles are missing from the figures: the main thread was kept from reading",
                    facts.trace_dropped));
  if (stages->cycles() == 0) facts.problems.push_back("no cycle was measured");
  const ordered_json verdicts = judge(limits, *stages);
  const ordered_json result = result_of(arguments, *stages, facts, verdicts);
  if (arguments.json)
    fmt::print("{}\n", app::to_text(result));
  else
    print_for_people(arguments, *stages, result);
  std::fflush(stdout);
  for (const std::string& problem : facts.problems) spdlog::error("{}", problem);
  if (facts.memory_locked && facts.page_faults.value_or(0) + facts.heap_calls.value_or(0) > 0)
    spdlog::warn("the control thread has taken {} page faults and made {} heap calls; there should be none",
                 *facts.page_faults, facts.heap_calls.value_or(0));
  if (!arguments.report.empty()) write_report(arguments.report, result);
  const bool all_met =
      std::ranges::all_of(verdicts, [](const auto& verdict) { return verdict["met"] == true; });
  return all_met && facts.problems.empty() ? app::kOk : app::kCheckFailed;
}

}  // namespace
}  // namespace tendril::tools

int main(int argc, char** argv) {
  using namespace tendril;
  app::CommandLine cli{
      "tendril-latency measures how late the control loop is: it runs the daemon's own cycle (bus, snapshot, "
      "QP, bus) with the model thread behind it and simulated drives on the bus, or the bare timer. "
      "Latencies count from the intended wake-up, and a stall counts for every period it covers. Rate, "
      "priority, CPUs and the model's rate are the robot file's unless given here. Ctrl-C ends it with "
      "results; docs/real-time.md says what to make of them.\n\n"
      "Exit codes: 0 measured; 1 a limit was broken, the controller stopped, or figures are missing; 2 wrong "
      "usage or robot file; "
      "3 the machine lacks something (rights, stress-ng)."};
  tools::Arguments arguments;
  cli.add("CONFIG", arguments.robot, "the robot: a YAML file, see docs/robot-file.md");
  cli.add_flag("--timer", arguments.timer, "the bare timer instead of a robot, to compare with cyclictest");
  cli.add("--bus", arguments.run.bus,
          "virtual CAN interface, for the kernel's CAN stack instead of a local bus: vcan0");
  cli.add("--rate", arguments.rate_hz, "Hz")
      .within(rt::DeadlineGrid::kLowestRateHz, rt::DeadlineGrid::kHighestRateHz);
  cli.add("--duration", arguments.run.duration_s, "seconds to measure; 0: until Ctrl-C").not_negative();
  cli.add("--priority", arguments.priority, "SCHED_FIFO").within(1, 98);
  cli.add("--cpu", arguments.cpu, "the only CPU of the thread that is measured").not_negative();
  cli.add("--others-cpu", arguments.others_cpu, "the only CPU of our other threads: model, drives, main")
      .not_negative();
  cli.add("--model-rate", arguments.model_rate, "Hz, at most; 0: as fast as the model can").not_negative();
  cli.add("--load", arguments.loads,
          "work beside it, unmap in this process, the others by stress-ng: " +
              fmt::format("{}", fmt::join(tools::load_names(), ", ")))
      .repeatable()
      .separated_by_commas()
      .one_of(tools::load_names());
  cli.add("--load-cpu", arguments.load_cpu,
          "the only CPU of the load; without it the load is wherever the kernel puts it, which is not "
          "on isolated CPUs")
      .not_negative();
  cli.add("--limit", arguments.limits,
          "STAGE:PERCENT:US, e.g. whole:99.9:200: exit code 1 where it is exceeded; may be repeated")
      .repeatable();
  cli.add("--report", arguments.report, "folder for latency.json, pictures and a page to pass on");
  cli.add_flag("--json", arguments.json, "one line of JSON instead of table and plot");
  cli.add_flag("--allow-non-rt", arguments.run.allow_non_rt,
               "measure without SCHED_FIFO and locked memory where they are refused");

  return app::run_program("tendril-latency", cli, argc, argv, [&] {
    app::watch_stop_signals();
    return tools::measure(arguments);
  });
}
