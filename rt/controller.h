// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "rt/control_law.h"
#include "rt/disturbance_observer.h"
#include "rt/inverse_problem.h"

namespace tendril::rt {

/// How a stop ends the motion, before the drives are disabled.
enum class StopAction : uint8_t {
  kHold,   ///< come to a halt and stay
  kRelax,  ///< come to a halt, then bring every actuator to its displacement at rest
};

struct ControllerConfig {
  int actuators = 0;                                 ///< m
  int effector_coordinates = 0;                      ///< e
  ActuatorVector a_min, a_max;                       ///< efforts, m, N or Pa
  ActuatorVector l_min, l_max;                       ///< displacements, m, m or m³
  ActuatorVector v_max;                              ///< top rates, > 0, m, m/s or m³/s
  std::array<bool, kMaxActuators> follows_effort{};  ///< the drive gets the effort, not the displacement
  EffectorVector workspace_min, workspace_max;       ///< where targets may lie, e, m or m³; may be infinite
  int iteration_cap = 100;                           ///< of the QP
  double period_s = 0;                               ///< s
  int64_t snapshot_age_limit_ns = 0;
  int64_t target_age_limit_ns = 0;
  int64_t disable_limit_ns = 1'000'000'000;  ///< a run that ends waits so long for drives to disable
  int late_cycles_limit = std::numeric_limits<int>::max();  ///< so many in a row end the run
  StopAction stop = StopAction::kHold;
  ObserverConfig feedback;         ///< of measured effectors; none measured: open loop
  bool waits_after_fault = false;  ///< for a reset, in kStandby; else a fault ends the run
};

/// The control law: from what is measured, known and wanted to what the drives shall do. A function of its
/// arguments and its own small state; no clock, no input or output, no globals.
///
/// While running it solves, for the newest target on the newest snapshot [Largilliere 2015, eqs. 5-6],
///   min ½ λᵀHλ + λᵀW_eaᵀD δ_e_free   s.t.   a_min ≤ λ ≤ a_max,   l_min ≤ W_aa λ + δ_a_free ≤ l_max,
/// the latter narrowed to what the top rates allow within one period, and commands δ_a = W_aa λ + δ_a_free.
/// Where effectors are measured, the target is moved by what the model does not explain, see
/// DisturbanceObserver. D, the squares of the effectors' weights, comes with the snapshot. Whatever happens,
/// no command moves an actuator faster than its top rate or leads it further out of its limits.
///
/// Every command holds both δ_a and λ; the drive of an actuator that follows efforts gets λ, and then δ_a is
/// where the model expects it. Such a drive exerts what it is told as soon as it is enabled: the efforts with
/// which the model rests at the displacements measured before. These move it by as much as the model errs, so
/// from then on the model follows the efforts and not the displacements. No effort that is commanded is ever
/// beyond its limits, or not finite.
class Controller final : public ControlLaw {
 public:
  /// Real-time: no (copies).
  explicit Controller(const ControllerConfig& config);

  /// Real-time: bounded by the QP's iteration cap; allocates nothing, takes no lock.
  const Decision& step(const hal::Measurement& measurement, const Snapshot* snapshot, const Target* target,
                       const CycleInput& cycle) noexcept override;

  /// Why the run stopped. Not while another thread runs the loop.
  const LatchedFault& latched() const noexcept { return decision_.latched; }

 private:
  void advance_phase(const hal::Measurement& measurement, const Snapshot* snapshot, int64_t now_ns) noexcept;
  void find_faults(const hal::Measurement& measurement, const CycleInput& cycle, FaultSet before) noexcept;
  void serve_operator(const CycleInput& cycle) noexcept;
  void begin_running(const hal::Measurement& measurement, const Snapshot& snapshot, int64_t now_ns) noexcept;
  bool ends(const CycleInput& cycle) const noexcept;
  void enter(Phase phase, int64_t now_ns) noexcept;
  void resume_delivered(bool undelivered) noexcept;
  void keep_delivered() noexcept;
  void serve_target(const Target* target, const CycleInput& cycle) noexcept;
  void correct(const hal::Measurement& measurement, const Snapshot& snapshot,
               const CycleInput& cycle) noexcept;
  void locate_effectors(const Snapshot& snapshot) noexcept;
  void run(const Snapshot& snapshot) noexcept;
  void solve(const Snapshot& snapshot) noexcept;
  void brake(bool relax) noexcept;
  void brake_effort(int a, bool relax) noexcept;
  void hold_measured(const hal::Measurement& measurement, const Snapshot* snapshot) noexcept;
  void command() noexcept;
  double allowed_effort(int a) const noexcept;
  double rest_displacement(int a) const noexcept;
  double rest_effort(int a) const noexcept;
  bool at_rest() const noexcept;

  ControllerConfig config_;
  InverseProblem problem_;
  DisturbanceObserver observer_;
  Decision decision_;
  ActuatorVector delta_a_;           // last command, m or m³
  ActuatorVector delivered_;         // the last one that the bus took, m or m³
  ActuatorVector delivered_lambda_;  // and its efforts, N or Pa
  ActuatorVector velocity_;          // of the last command, m/s or m³/s
  bool any_effort_ = false;          // an actuator follows efforts
  bool has_target_ = false;
  bool end_requested_ = false;  // the run shall end, not wait in kStandby
  int64_t phase_since_ns_ = 0;
  int64_t resumed_ns_ = 0;  // when kStandby was left: older snapshots and targets belong to another start
  int64_t stop_limit_ns_;   // the longest that coming to a halt can take
};

}  // namespace tendril::rt
