// SPDX-License-Identifier: Apache-2.0
#include "tools/coupling_variation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "app/robot/inverse_statics.h"

namespace tendril::tools {
namespace {

constexpr double kSettledWithin = 2;  // s of virtual time
constexpr double kPeriodsAfter = 5;   // of the model, in which it comes to rest
constexpr double kRatesRaised = 10;   // times the drives' own
constexpr double kBodyStep = 50e-3;   // s; nothing depends on it
constexpr double kNsVariation = 1e-9;

double infinity_norm(const rt::Snapshot& snapshot) {
  const Eigen::MatrixXd M = snapshot.W_ea.transpose() * snapshot.W_ea;
  return M.cwiseAbs().rowwise().sum().maxCoeff();
}

/// The same robot with the line as its motion: the approach to its only waypoint.
app::Config on_line(app::Config config, const Eigen::Vector3d& way, double speed) {
  const rt::EffectorVector rest = app::effectors_at_rest(*app::build_model(config));
  app::MotionConfig line{.waypoints = {way}, .speed = speed, .closed = false};
  if (config.motion) line.effector = config.motion->effector;
  const auto rows = app::effector_rows(config);
  for (std::size_t r = 0; r < rows.size(); ++r)
    if (rows[r].effector == line.effector && rows[r].is_position())
      line.origin[rows[r].axis] = rest[static_cast<Eigen::Index>(r)];
  config.motion = line;
  for (app::ActuatorConfig& actuator : config.actuators) actuator.top_rate *= kRatesRaised;
  config.plant->time_step = kBodyStep;
  return config;
}

}  // namespace

CouplingVariation variation_on_line(app::Config config, const Eigen::Vector3d& way, double speed,
                                    const Loops& loops) {
  config.control.model_tangent = loops.tangent;
  app::VirtualRig rig(on_line(std::move(config), way, speed), loops.settings());
  CouplingVariation variation;
  double before = 0;
  rig.observe_snapshots([&](const rt::Snapshot& snapshot) {
    const double norm = infinity_norm(snapshot);
    if (rig.motion()) variation.changes.push_back(std::abs(norm - before) / before);
    before = norm;
  });
  rig.run_until(rt::Phase::kRunning, kSettledWithin);
  if (!rig.motion()) throw std::runtime_error("the drives did not come up in virtual time");
  const double left = kNsVariation * static_cast<double>(rig.motion()->path_start_ns() - rig.now_ns());
  rig.run_for(left + kPeriodsAfter / loops.model_rate_hz);
  if (rig.phase() != rt::Phase::kRunning || variation.changes.empty())
    throw std::runtime_error("the run along the line ended before the line did");
  variation.largest = *std::max_element(variation.changes.begin(), variation.changes.end());
  return variation;
}

double speed_at(double value, const std::vector<double>& speeds, const std::vector<double>& found) {
  for (std::size_t k = 1; k < found.size(); ++k)
    if (found[k] >= value && found[k - 1] < value)
      return speeds[k - 1] + (value - found[k - 1]) / (found[k] - found[k - 1]) * (speeds[k] - speeds[k - 1]);
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace tendril::tools
