// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "rt/controller.h"

namespace tendril::rt::testing {

/// A body of one cable and one effector coordinate: p_e = kCoupling λ, δ_a = kCompliance λ + kFree.
inline constexpr double kCoupling = 0.010, kCompliance = 0.004, kFree = -0.001;  // m/N, m/N, m
inline constexpr int64_t kMillisecond = 1'000'000;
inline constexpr double kPeriod_s = 1e-3;

inline ControllerConfig one_cable() {
  ControllerConfig config;
  config.actuators = config.effector_coordinates = 1;
  config.a_min.setZero(1);
  config.a_max.setConstant(1, 5.0);
  config.l_min.setConstant(1, -0.010);
  config.l_max.setConstant(1, 0.012);
  config.v_max.setConstant(1, 0.5);
  config.workspace_min.setConstant(1, -0.1);
  config.workspace_max.setConstant(1, 0.1);
  config.period_s = kPeriod_s;
  config.snapshot_age_limit_ns = 50 * kMillisecond;
  config.target_age_limit_ns = 20 * kMillisecond;
  config.late_cycles_limit = 3;
  return config;
}

inline void fill_snapshot(Snapshot& snapshot, int64_t now_ns) {
  snapshot.sequence += 1;
  snapshot.stamp_ns = now_ns;
  snapshot.W_ea.setConstant(1, 1, kCoupling);
  snapshot.D_W_ea = snapshot.W_ea;
  snapshot.W_aa.setConstant(1, 1, kCompliance);
  snapshot.G_ea.setConstant(1, 1, kCoupling / kCompliance);
  snapshot.delta_a_free.setConstant(1, kFree);
  snapshot.p_e_free.setZero(1);
  snapshot.lambda.setConstant(1, -kFree / kCompliance);  // at rest with the length at rest
  const qp::Matrix H = qp::Matrix::Constant(1, 1, kCoupling * kCoupling);
  (void)snapshot.problem.prepare(H, snapshot.W_aa);
}

inline Target still(double position, int64_t now_ns) {
  Target target;
  target.position.setConstant(1, position);
  target.velocity.setZero(1);
  target.stamp_ns = target.until_ns = now_ns;
  return target;
}

/// A controller, its one cable and drives that do as they are told.
struct Rig {
  ControllerConfig config = one_cable();
  Controller controller{config};
  std::unique_ptr<Snapshot> snapshot = std::make_unique<Snapshot>();
  Target target = still(0.02, 0);
  hal::Measurement measurement;
  CycleInput cycle;

  Rig() : Rig(one_cable()) {}
  explicit Rig(const ControllerConfig& c) : config(c), controller(c) {
    measurement.axes = 1;
    measurement.all_known = true;
    cycle.now_ns = 1000 * kMillisecond;
  }

  /// One cycle; snapshot and target are fresh unless they are kept.
  const Decision& step(bool fresh_snapshot = true, bool fresh_target = true) {
    cycle.now_ns += kMillisecond;
    if (fresh_snapshot) fill_snapshot(*snapshot, cycle.now_ns);
    if (fresh_target) target.stamp_ns = target.until_ns = cycle.now_ns;
    const Decision& decision = controller.step(measurement, snapshot.get(), &target, cycle);
    measurement.all_enabled = decision.command.enable;
    measurement.all_disabled = measurement.finished = !decision.command.enable;
    if (decision.command.enable) measurement.displacement[0] = decision.command.displacement[0];
    return decision;
  }
  const Decision& step_until(Phase phase) {
    for (int k = 0; k < 1000; ++k)
      if (step().phase >= phase) break;
    return step();
  }
};

}  // namespace tendril::rt::testing
