// SPDX-License-Identifier: Apache-2.0
#include "app/robot/qp_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "app/robot/cpu_time.h"
#include "app/robot/model_refresher.h"
#include "rt/inverse_problem.h"

namespace tendril::app {
namespace {

// Of the cycle: the bus, the wake-up and the model thread's use of the caches need the rest.
constexpr double kShare = 0.25;
// For n actuators. A solve from nothing takes about 2n where no rows conflict. One that is cut short goes on
// from its working set a cycle later, and that leads nowhere where a cycle has too few for what is done anew
// in each: looking into a conflict of rows, and the passes of a problem of two levels.
constexpr int needed_iterations(int n) { return 4 * n + 8; }
constexpr double kIterationQuantile = 0.99;
constexpr int kIterationSamples = 200;
// An instant on the clock is as long as several iterations of a small problem: so many problems are a sample.
constexpr int kSolves = 4;

/// Problems that take as long as any: of which neither target nor displacements can be had within the limits
/// of the efforts, one unlike the other.
class Conflicts {
 public:
  Conflicts(const rt::Snapshot& snapshot, const rt::ControllerConfig& limits)
      : snapshot_(snapshot), limits_(limits), problem_(limits.a_min, limits.a_max, limits.iteration_cap) {}

  /// Solves the next one from an empty working set; its iterations.
  int solve() {
    const rt::EffectorVector desired = snapshot_.p_e_free + snapshot_.W_ea * beyond();
    const rt::ActuatorVector displacements = snapshot_.delta_a_free + snapshot_.W_aa * beyond();
    problem_.forget_working_set();
    return problem_.solve(snapshot_, desired, displacements, displacements, limits_.a_min).iterations;
  }

 private:
  /// Efforts, each outside its limits by as much as they are apart at most.
  rt::ActuatorVector beyond() {
    rt::ActuatorVector lambda = limits_.a_min;
    for (Eigen::Index a = 0; a < lambda.size(); ++a) {
      const double share = share_(random_);
      lambda[a] =
          (share > 0 ? limits_.a_max : limits_.a_min)[a] + share * (limits_.a_max[a] - limits_.a_min[a]);
    }
    return lambda;
  }

  const rt::Snapshot& snapshot_;
  const rt::ControllerConfig& limits_;
  rt::InverseProblem problem_;
  std::mt19937 random_;  // the same problems at each start
  std::uniform_real_distribution<double> share_{-1, 1};
};

}  // namespace

double time_iteration(const Robot& robot, const Config& config) {
  const auto snapshot = std::make_unique<rt::Snapshot>();
  linearise_at_rest(robot, config, 0, *snapshot);
  rt::ControllerConfig limits = controller_config(config);
  limits.iteration_cap = useful_iterations(limits.actuators);
  const auto conflicts = std::make_unique<Conflicts>(*snapshot, limits);
  std::vector<double> times;
  for (int k = 0; k < kIterationSamples; ++k) {
    int iterations = 0;
    const double begin = cpu_seconds();
    for (int j = 0; j < kSolves; ++j) iterations += conflicts->solve();
    times.push_back((cpu_seconds() - begin) / std::max(iterations, 1));
  }
  const auto high = times.begin() + static_cast<long>(kIterationQuantile * (kIterationSamples - 1));
  std::nth_element(times.begin(), high, times.end());
  return *high;
}

QpBudget judge_qp(const Config& config, double iteration_s) {
  const int n = static_cast<int>(config.actuators.size()), needed = needed_iterations(n);
  const double rate_hz = config.control.rate_hz, share_s = kShare / rate_hz;
  const double fit = std::floor(share_s / iteration_s);
  const std::string cost =
      fmt::format("an iteration costs {:.2g} us here; {:.0f} fit into a quarter of the {:.0f} us cycle",
                  1e6 * iteration_s, fit, 1e6 / rate_hz);
  QpBudget budget;
  budget.iteration_s = iteration_s;
  budget.cap =
      config.control.iteration_cap.value_or(std::lround(std::min<double>(fit, useful_iterations(n))));
  if (!config.control.iteration_cap && fit < needed)
    throw ConfigError(fmt::format(
        "{}: control.rate: found {:g} Hz, expected at most {:.3g} Hz for {} actuators: the QP needs {} "
        "iterations, and {}; lower the rate, take fewer actuators, or set control.iteration_cap",
        config.file.string(), rate_hz, kShare / (needed * iteration_s), n, needed, cost));
  budget.text = fmt::format("{}; cap {}, at most {:.0f} thousand floating-point operations", cost, budget.cap,
                            1e-3 * qp::worst_case_operations(n, n, budget.cap));
  if (budget.cap > fit) budget.text += ": more than fit, lower control.iteration_cap or control.rate";
  return budget;
}

rt::ControllerConfig controller_config_for_this_machine(const Robot& robot, const Config& config) {
  rt::ControllerConfig limits = controller_config(config);
  if (!config.control.iteration_cap)
    limits.iteration_cap = judge_qp(config, time_iteration(robot, config)).cap;
  return limits;
}

}  // namespace tendril::app
