// SPDX-License-Identifier: Apache-2.0
#include "tools/path_run.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tendril::tools {
namespace {

constexpr double kStartWithin = 2;  // s of virtual time
constexpr double kNs = 1e-9;

/// Length of the closed path, m.
double length(const app::MotionConfig& motion) {
  double sum = (motion.waypoints.front() - motion.waypoints.back()).norm();
  for (std::size_t k = 1; k < motion.waypoints.size(); ++k)
    sum += (motion.waypoints[k] - motion.waypoints[k - 1]).norm();
  return sum;
}

}  // namespace

Errors PathRun::errors() const {
  std::vector<double> sorted;
  double sum = 0;
  for (const Seen& sample : seen) {
    sorted.push_back(sample.error());
    sum += sorted.back();
  }
  std::sort(sorted.begin(), sorted.end());
  const auto n = sorted.size();
  return {sum / static_cast<double>(n), sorted[(95 * n) / 100], sorted.back()};
}

double PathRun::roughness() const {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t k = 2; k < sent.size(); ++k)
    for (std::size_t a = 0; a < sent[k].displacement.size(); ++a, ++count) {
      const double period = 0.5 * (sent[k].t - sent[k - 2].t);
      const double second =
          sent[k].displacement[a] - 2 * sent[k - 1].displacement[a] + sent[k - 2].displacement[a];
      sum += std::pow(second / (period * period), 2);
    }
  return std::sqrt(sum / static_cast<double>(count));
}

PathRun run_path(app::Config config, double speed, double rounds, const Loops& loops) {
  if (!config.motion || !config.motion->closed || app::effector_rows(config).size() != 3)
    throw std::runtime_error(config.file.string() +
                             ": needs a closed motion and one effector, a point with coordinates xyz");
  config.motion->speed = speed;
  config.control.model_tangent = loops.tangent;
  app::VirtualRig rig(config, loops.settings());
  rig.run_until(rt::Phase::kRunning, kStartWithin);
  if (!rig.motion()) throw std::runtime_error("the drives did not come up in virtual time");
  const int64_t begin_ns = rig.motion()->path_start_ns();
  const double left = kNs * static_cast<double>(begin_ns - rig.now_ns());
  rig.run_for(left + rounds * length(*config.motion) / speed);
  if (rig.phase() != rt::Phase::kRunning) throw std::runtime_error("a fault ended the run before its end");

  PathRun run;
  for (const app::PlantMeasurement& seen : rig.measurements())
    if (seen.stamp_ns >= begin_ns)
      run.seen.push_back({kNs * static_cast<double>(seen.stamp_ns - begin_ns), seen.tip,
                          rig.motion()->at(seen.stamp_ns).position});
  for (const rt::TraceRecord& cycle : rig.trace())
    if (cycle.intended_ns >= begin_ns)
      run.sent.push_back({kNs * static_cast<double>(cycle.intended_ns - begin_ns),
                          {cycle.command.begin(), cycle.command.begin() + std::ssize(config.actuators)}});
  return run;
}

}  // namespace tendril::tools
