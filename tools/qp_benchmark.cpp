// SPDX-License-Identifier: Apache-2.0
// What each solve of the recorded control cycles costs, and whether it is right. tools/bench runs it, and
// tools/qp_benchmark.py reads what it prints.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "rt/periodic_clock.h"
#include "tests/qp/redundant_sequence.h"
#include "tests/qp/sequence.h"
#ifdef TENDRIL_HAS_CGAL
#include "tests/qp/exact_solution.h"
#endif

namespace tendril {
namespace {

using Json = nlohmann::json;

constexpr double kAccuracy = 1e-8;             // of the objective, relative to its scale
constexpr double kAccuracyOfTwoLevels = 1e-7;  // Solver::solve() promises no more
constexpr std::size_t kExact = 50;             // ticks that CGAL solves too

enum class Mode { kWarm, kCold };

/// Prepared problems and the solver that goes through them, tick by tick.
class Replay {
 public:
  explicit Replay(const qp::Sequence& sequence) : sequence_(sequence), problems_(sequence.snapshots.size()) {
    for (std::size_t i = 0; i < problems_.size(); ++i) {
      const auto prepared =
          problems_[i].prepare(sequence.snapshots[i].H, sequence.snapshots[i].A, sequence.tie_break);
      if (prepared != qp::Preparation::kReady)
        throw std::runtime_error(
            fmt::format("{}: snapshot {} is refused: {}", sequence.name, i, qp::name(prepared)));
    }
  }

  /// Solves all ticks in order, from no working set at first.
  /// @param look  called after each with the tick's number, what the solve took in ns, and the solution
  template <typename Look>
  void run(Mode mode, int cap, Look&& look) {
    solver_.reset();
    qp::Vector hold = qp::Vector::Zero(problems_[0].n());
    for (std::size_t i = 0; i < sequence_.ticks.size(); ++i) {
      const qp::Sequence::Tick& tick = sequence_.ticks[i];
      if (mode == Mode::kCold) solver_.reset();
      const auto begin = rt::now_ns();
      const qp::Solution& solution = solver_.solve(problems_[tick.snapshot], tick.g, tick.bounds, hold, cap);
      const auto end = rt::now_ns();
      look(i, end - begin, solution);
      hold = solution.x;
    }
  }

 private:
  const qp::Sequence& sequence_;
  std::vector<qp::Problem> problems_;
  qp::Solver solver_;
};

/// What is wrong with the solution of a tick; empty where nothing is.
std::string fault(const qp::Sequence& sequence, const qp::Sequence::Tick& tick,
                  const qp::Solution& solution) {
  const auto expected = tick.infeasible ? qp::Status::kSoftened : qp::Status::kOptimal;
  if (solution.status != expected)
    return fmt::format("{} instead of {}", qp::name(solution.status), qp::name(expected));
  const qp::Vector& x = solution.x;
  if (!(x.array() >= tick.bounds.lower.array() && x.array() <= tick.bounds.upper.array()).all())
    return "a bound is passed";
  if (tick.infeasible) return "";
  const qp::Matrix& H = sequence.snapshots[tick.snapshot].H;
  const double error = (0.5 * x.dot(H * x) + tick.g.dot(x) - tick.objective) / tick.scale;
  const bool two_levels = sequence.tie_break == qp::TieBreak::kLeastEnergy;
  if (!(std::abs(error) <= (two_levels ? kAccuracyOfTwoLevels : kAccuracy)))
    return fmt::format("the objective is off by {:.1e} of its scale", error);
  return "";
}

/// What reading the clock twice takes, ns: the median of many.
int64_t clock_cost_ns() {
  std::vector<int64_t> costs(1001);
  for (auto& cost : costs) {
    const auto begin = rt::now_ns();
    cost = rt::now_ns() - begin;
  }
  std::nth_element(costs.begin(), costs.begin() + costs.size() / 2, costs.end());
  return costs[costs.size() / 2];
}

#ifdef TENDRIL_HAS_CGAL
/// Whether H is positive definite beyond the rounding of its entries.
bool strictly_convex(const qp::Matrix& H) {
  const Eigen::VectorXd eigenvalues =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(H, Eigen::EigenvaluesOnly).eigenvalues();
  const double rounding = static_cast<double>(H.rows()) * std::numeric_limits<double>::epsilon();
  return eigenvalues.minCoeff() > rounding * eigenvalues.maxCoeff();
}
#endif

/// What CGAL's QP_solver takes for ticks spread over the sequence, ns; nothing where there is no CGAL. A
/// singular H is left out: rounded, it has negative eigenvalues, and CGAL then does not return.
std::vector<int64_t> time_cgal([[maybe_unused]] const qp::Sequence& sequence) {
  std::vector<int64_t> ns;
#ifdef TENDRIL_HAS_CGAL
  for (std::size_t k = 0; k < kExact; ++k) {
    const qp::Sequence::Tick& tick = sequence.ticks[k * sequence.ticks.size() / kExact];
    const auto& [H, A] = sequence.snapshots[tick.snapshot];
    if (!strictly_convex(H)) continue;
    const qp::Qp qp{H, A, tick.g, tick.bounds};
    const auto begin = rt::now_ns();
    (void)qp::ExactSolution::of(qp);
    ns.push_back(rt::now_ns() - begin);
  }
#endif
  return ns;
}

Json benchmark(const qp::Sequence& sequence, Mode mode, int cap, int passes) {
  const std::size_t ticks = sequence.ticks.size();
  std::vector<int> iterations(ticks);
  std::vector<std::size_t> swaps;
  std::vector<int64_t> ns(ticks, std::numeric_limits<int64_t>::max());
  Json faults = Json::array();
  Replay replay(sequence);
  for (int pass = 0; pass < passes; ++pass) {
    replay.run(mode, cap, [&](std::size_t i, int64_t took_ns, const qp::Solution& solution) {
      ns[i] = std::min(ns[i], took_ns);
      if (pass > 0) return;
      const qp::Sequence::Tick& tick = sequence.ticks[i];
      iterations[i] = solution.iterations;
      if (i > 0 && tick.snapshot != sequence.ticks[i - 1].snapshot) swaps.push_back(i);
      if (const std::string what = fault(sequence, tick, solution); !what.empty())
        faults.push_back({{"tick", i}, {"what", what}});
    });
  }
  return {{"name", sequence.name},
          {"m", sequence.snapshots[0].H.rows()},
          {"e", sequence.effector_coordinates},
          {"mode", mode == Mode::kCold ? "cold" : "warm"},
          {"iterations", iterations},
          {"ns", ns},
          {"cgal_ns", time_cgal(sequence)},
          {"clock_ns", clock_cost_ns()},
          {"swaps", swaps},
          {"faults", faults}};
}

}  // namespace
}  // namespace tendril

int main(int argc, char** argv) {
  CLI::App app("Replays a sequence of control cycles through the QP solver; prints one line of JSON.");
  std::string file;
  int cap = 1000, passes = 5;
  bool cold = false, list = false, silent = false;
  auto* sequence =
      app.add_option("FILE", file, "sequence, .qps with its .ref next to it, or the name of a generated one");
  app.add_option("--cap", cap, "iterations after which a solve gives up");
  app.add_option("--passes", passes, "replays to time; of each tick the shortest time counts")
      ->check(CLI::PositiveNumber);
  app.add_flag("--cold", cold, "each tick from an empty working set");
  sequence->excludes(app.add_flag("--list", list, "the files there are, one a line"));
  app.add_flag("--silent", silent, "one replay and no output, for a tool that counts instructions");
  CLI11_PARSE(app, argc, argv);
  try {
    if (list) {
      for (const auto& each : tendril::qp::sequence_files()) fmt::print("{}\n", each.string());
      for (const auto& each : tendril::qp::redundant_sequences()) fmt::print("{}\n", each);
      return 0;
    }
    const auto& generated = tendril::qp::redundant_sequences();
    const bool is_generated = std::find(generated.begin(), generated.end(), file) != generated.end();
    const auto recorded =
        is_generated ? tendril::qp::redundant_sequence(file) : tendril::qp::read_sequence(file);
    const auto mode = cold ? tendril::Mode::kCold : tendril::Mode::kWarm;
    if (silent)
      tendril::Replay(recorded).run(mode, cap, [](auto&&...) {});
    else
      fmt::print("{}\n", tendril::benchmark(recorded, mode, cap, passes).dump());
  } catch (const std::exception& error) {
    fmt::print(stderr, "qp_benchmark: {}\n", error.what());
    return 1;
  }
}
