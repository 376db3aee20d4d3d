// SPDX-License-Identifier: Apache-2.0
#include "rt/controller.h"

#include <algorithm>
#include <cmath>

namespace tendril::rt {
namespace {

// A stop takes the commanded speed to zero within this time.
constexpr double kRampTime = 0.2;  // s
// Relaxing moves actuators at this share of their top rate.
constexpr double kRelaxShare = 0.25;
// The next two are times at the top rate: it measures metres and cubic metres alike.
// Relaxing has arrived when it is as near to rest as this.
constexpr double kArrived = 1e-6;  // s
// By how much the QP's answer may pass a displacement limit before it counts as a conflict of limits.
constexpr double kLimitTolerance = 1e-5;  // s
// Targets on the border of the workspace are inside in spite of rounding.
constexpr double kBorder = 1e-9;  // m; the workspace has no border for volumes

bool inside(const EffectorVector& p, const EffectorVector& lower, const EffectorVector& upper) noexcept {
  return p.allFinite() && (p.array() >= lower.array() - kBorder).all() &&
         (p.array() <= upper.array() + kBorder).all();
}

}  // namespace

Controller::Controller(const ControllerConfig& config)
    : config_(config),
      problem_(config.a_min, config.a_max, config.iteration_cap),
      observer_(config.feedback, config.effector_coordinates) {
  const auto m = config.actuators;
  delta_a_.setZero(m);
  velocity_.setZero(m);
  delivered_.setZero(m);
  delivered_lambda_.setZero(m);
  decision_.command.axes = m;
  decision_.lambda.setZero(m);
  for (int a = 0; a < m; ++a) {
    any_effort_ = any_effort_ || config.follows_effort[a];
    decision_.command.effort[a] = rest_effort(a);
  }
  decision_.desired.setZero(config.effector_coordinates);
  decision_.p_e.setZero(config.effector_coordinates);
  decision_.correction.setZero(config.effector_coordinates);
  const double relaxing_s =
      ((config.l_max - config.l_min).array() / (kRelaxShare * config.v_max.array())).maxCoeff();
  stop_limit_ns_ =
      std::llround(1e9 * (2 * kRampTime + (config.stop == StopAction::kRelax ? 2 * relaxing_s : 0)));
}

const Decision& Controller::step(const hal::Measurement& measurement, const Snapshot* snapshot,
                                 const Target* target, const CycleInput& cycle) noexcept {
  const FaultSet before = decision_.faults;
  decision_.faults = {};
  decision_.qp_solved = false;
  decision_.qp_iterations = 0;
  decision_.snapshot_age_ns = snapshot ? cycle.now_ns + cycle.wakeup_ns - snapshot->stamp_ns : 0;
  decision_.command.reset = false;
  resume_delivered(cycle.undelivered);
  find_faults(measurement, cycle, before);
  serve_operator(cycle);
  if (snapshot) correct(measurement, *snapshot, cycle);
  const bool was_running = decision_.phase == Phase::kRunning;
  advance_phase(measurement, snapshot, cycle.now_ns);
  switch (decision_.phase) {
    case Phase::kConnecting:
    case Phase::kModelling:
    case Phase::kEnabling:  // hold what is measured: enabling must not move anything
      hold_measured(measurement, snapshot);
      break;
    case Phase::kStandby:
      hold_measured(measurement, snapshot);
      if (!snapshot) break;
      locate_effectors(*snapshot);
      decision_.desired = decision_.p_e;
      break;
    case Phase::kRunning:  // the first command that drives follow is what they have measured
      serve_target(target, cycle);
      if (was_running) run(*snapshot);
      break;
    case Phase::kStopping:
      brake(config_.stop == StopAction::kRelax);
      break;
    case Phase::kDisabling:
    case Phase::kStopped:
      break;
  }
  command();
  return decision_;
}

/// Drives that have missed commands stand at the last one that they got. From there on the robot goes on from
/// rest.
void Controller::resume_delivered(bool undelivered) noexcept {
  if (decision_.phase != Phase::kRunning && decision_.phase != Phase::kStopping) return;
  if (!undelivered) return keep_delivered();
  delta_a_ = delivered_;
  decision_.lambda = delivered_lambda_;
  velocity_.setZero();
}

void Controller::keep_delivered() noexcept {
  delivered_ = delta_a_;
  delivered_lambda_ = decision_.lambda;
}

void Controller::command() noexcept {
  hal::Command& command = decision_.command;
  for (int a = 0; a < config_.actuators; ++a) {
    command.displacement[a] = delta_a_[a];
    command.effort[a] = allowed_effort(a);
    if (config_.follows_effort[a]) decision_.lambda[a] = command.effort[a];
  }
  command.enable = decision_.phase >= Phase::kEnabling && decision_.phase <= Phase::kStopping;
  command.finish = decision_.phase >= Phase::kDisabling;
  decision_.efforts_active = decision_.phase >= (any_effort_ ? Phase::kEnabling : Phase::kRunning) &&
                             decision_.phase != Phase::kStandby;
}

/// λ within its limits; the last one where it is no number.
double Controller::allowed_effort(int a) const noexcept {
  const double lambda = decision_.lambda[a];
  return std::isfinite(lambda) ? std::clamp(lambda, config_.a_min[a], config_.a_max[a])
                               : decision_.command.effort[a];
}

/// Where all actuators are, and with which efforts, before the controller moves any.
void Controller::hold_measured(const hal::Measurement& measurement, const Snapshot* snapshot) noexcept {
  if (snapshot) decision_.lambda = snapshot->lambda;
  for (int a = 0; a < config_.actuators; ++a)
    if (config_.follows_effort[a]) decision_.lambda[a] = allowed_effort(a);
  for (int a = 0; a < config_.actuators; ++a) {
    delta_a_[a] = measurement.displacement[a];
    if (!snapshot || !config_.follows_effort[a]) continue;
    const double modelled = snapshot->W_aa.row(a).dot(decision_.lambda) + snapshot->delta_a_free[a];
    if (std::isfinite(modelled)) delta_a_[a] = modelled;
  }
  keep_delivered();  // drives that are not enabled yet hold what they measure, whatever they hear
}

void Controller::enter(Phase phase, int64_t now_ns) noexcept {
  decision_.phase = phase;
  phase_since_ns_ = now_ns;
}

void Controller::find_faults(const hal::Measurement& measurement, const CycleInput& cycle,
                             FaultSet before) noexcept {
  if (measurement.fault.kind != hal::FaultKind::kNone) decision_.faults.add(Fault::kDrives);
  if (measurement.sensors.lost >= 0) decision_.faults.add(Fault::kSensorLost);
  if (cycle.late_in_a_row >= config_.late_cycles_limit) decision_.faults.add(Fault::kLateCycles);
  if (cycle.model_failed) decision_.faults.add(Fault::kModelFailed);
  // What is found while the robot comes to a halt for another reason does not change what follows.
  const bool halts = decision_.phase == Phase::kStopping || decision_.phase >= Phase::kDisabling;
  if (halts || decision_.latched.present) return;
  for (const FaultRule& entry : kFaultTable)
    if (entry.reaction == Reaction::kStop && (decision_.faults.has(entry.fault) || before.has(entry.fault)))
      decision_.latched = {true, entry.fault, measurement.fault, measurement.sensors.lost, cycle.now_ns};
}

/// Whether the run shall end, and not wait in kStandby.
bool Controller::ends(const CycleInput& cycle) const noexcept {
  const LatchedFault& latched = decision_.latched;
  const bool other_master =
      latched.fault == Fault::kDrives && latched.drive.kind == hal::FaultKind::kOtherMaster;
  return cycle.stop_requested || (latched.present && (!config_.waits_after_fault || other_master));
}

/// Leaves kRunning, or what leads to it, where the drives are not wanted; returns to it where they are.
void Controller::serve_operator(const CycleInput& cycle) noexcept {
  if (decision_.phase >= Phase::kDisabling) return;
  if (decision_.phase == Phase::kStandby && cycle.reset_requested && decision_.latched.present) {
    decision_.latched = {};
    decision_.faults = {};  // judged anew from the next cycle on
    decision_.command.reset = true;
    return;
  }
  end_requested_ = end_requested_ || ends(cycle);
  const bool wanted = !end_requested_ && !decision_.latched.present && !cycle.standby_requested;
  if (decision_.phase == Phase::kStandby) {
    if (!end_requested_ && !wanted) return;
    resumed_ns_ = cycle.now_ns;
    enter(wanted ? Phase::kConnecting : Phase::kDisabling, cycle.now_ns);
  } else if (!wanted && decision_.phase != Phase::kStopping) {
    // Only drives that follow commands can be braked.
    const Phase without_torque = end_requested_ ? Phase::kDisabling : Phase::kStandby;
    enter(decision_.phase == Phase::kRunning ? Phase::kStopping : without_torque, cycle.now_ns);
  }
}

void Controller::advance_phase(const hal::Measurement& measurement, const Snapshot* snapshot,
                               int64_t now_ns) noexcept {
  const int64_t elapsed_ns = now_ns - phase_since_ns_;
  switch (decision_.phase) {
    case Phase::kConnecting:
      if (measurement.all_known && measurement.sensors.ready) enter(Phase::kModelling, now_ns);
      break;
    case Phase::kModelling:
      if (snapshot && snapshot->stamp_ns >= resumed_ns_) enter(Phase::kEnabling, now_ns);
      break;
    case Phase::kEnabling:
      if (measurement.all_enabled) begin_running(measurement, *snapshot, now_ns);
      break;
    case Phase::kStopping:
      if (at_rest() || elapsed_ns > stop_limit_ns_)
        enter(end_requested_ ? Phase::kDisabling : Phase::kStandby, now_ns);
      break;
    case Phase::kDisabling:
      if (measurement.finished || elapsed_ns > config_.disable_limit_ns) enter(Phase::kStopped, now_ns);
      break;
    case Phase::kRunning:
    case Phase::kStandby:
    case Phase::kStopped:
      break;
  }
}

void Controller::begin_running(const hal::Measurement& measurement, const Snapshot& snapshot,
                               int64_t now_ns) noexcept {
  enter(Phase::kRunning, now_ns);
  hold_measured(measurement, &snapshot);
  velocity_.setZero();
  locate_effectors(snapshot);
  decision_.desired = decision_.p_e;
  has_target_ = false;
}

void Controller::locate_effectors(const Snapshot& snapshot) noexcept {
  decision_.p_e.noalias() = snapshot.W_ea * decision_.lambda + snapshot.p_e_free;
  decision_.p_e += decision_.correction;
}

/// Compares what has been measured with what the model says of that instant.
void Controller::correct(const hal::Measurement& measurement, const Snapshot& snapshot,
                         const CycleInput& cycle) noexcept {
  const bool exerted = decision_.efforts_active;  // else the body rests under the efforts of the snapshot
  observer_.step(measurement, exerted ? decision_.lambda : snapshot.lambda, snapshot,
                 cycle.now_ns + cycle.wakeup_ns);
  decision_.correction = observer_.disturbance();
}

void Controller::serve_target(const Target* target, const CycleInput& cycle) noexcept {
  if (!target || target->stamp_ns < resumed_ns_) return;
  if (cycle.now_ns + cycle.wakeup_ns - target->stamp_ns > config_.target_age_limit_ns) {
    decision_.faults.add(Fault::kTargetStale);
    return;
  }
  const bool fits = target->position.size() == config_.effector_coordinates &&
                    target->velocity.size() == config_.effector_coordinates;
  if (!fits || !inside(target->at(cycle.now_ns), config_.workspace_min, config_.workspace_max)) {
    decision_.faults.add(Fault::kTargetRefused);
    return;
  }
  decision_.desired = target->at(cycle.now_ns);
  has_target_ = true;
}

void Controller::run(const Snapshot& snapshot) noexcept {
  if (decision_.snapshot_age_ns > config_.snapshot_age_limit_ns) decision_.faults.add(Fault::kSnapshotStale);
  if (has_target_ && !decision_.faults.demand(Reaction::kHalt)) solve(snapshot);
  if (!has_target_ || decision_.faults.demand(Reaction::kHalt)) brake(false);
  locate_effectors(snapshot);
  if (!has_target_) decision_.desired = decision_.p_e;
}

void Controller::solve(const Snapshot& snapshot) noexcept {
  // Top rates narrow the limits to a window around the last command; where an actuator stands outside its
  // limits (it may have been moved by hand), the window leads back to them as fast as it may.
  const ActuatorVector reach = config_.v_max * config_.period_s;
  const ActuatorVector lower = config_.l_min.cwiseMax(delta_a_ - reach).cwiseMin(delta_a_ + reach);
  const ActuatorVector upper = config_.l_max.cwiseMin(delta_a_ + reach).cwiseMax(delta_a_ - reach);
  const EffectorVector aim = decision_.desired - decision_.correction;
  const qp::Solution& solution = problem_.solve(snapshot, aim, lower, upper, decision_.lambda);
  decision_.qp_solved = true;
  decision_.qp_status = solution.status;
  decision_.qp_iterations = solution.iterations;
  if (solution.status == qp::Status::kCapped) decision_.faults.add(Fault::kQpCapped);
  if (solution.status == qp::Status::kIllPosed) decision_.faults.add(Fault::kQpIllPosed);
  if (decision_.faults.demand(Reaction::kHalt)) return;

  decision_.lambda = solution.x;
  const ActuatorVector asked = snapshot.W_aa * solution.x + snapshot.delta_a_free;
  // Where only the top rate stands in the way, the efforts' limits will be met in a few cycles.
  const ActuatorVector tolerance = kLimitTolerance * config_.v_max;
  if (((asked - config_.l_max).array() > tolerance.array()).any() ||
      ((config_.l_min - asked).array() > tolerance.array()).any())
    decision_.faults.add(Fault::kQpSoftened);
  // An actuator outside its limits comes no nearer to them than its effort allows, and goes no further away.
  const ActuatorVector next = asked.cwiseMax(config_.l_min.cwiseMin(delta_a_))
                                  .cwiseMin(config_.l_max.cwiseMax(delta_a_))
                                  .cwiseMax(delta_a_ - reach)
                                  .cwiseMin(delta_a_ + reach);
  velocity_ = (next - delta_a_) / config_.period_s;
  delta_a_ = next;
}

double Controller::rest_displacement(int a) const noexcept {
  return std::clamp(0.0, config_.l_min[a], config_.l_max[a]);
}

double Controller::rest_effort(int a) const noexcept {
  return std::clamp(0.0, config_.a_min[a], config_.a_max[a]);
}

bool Controller::at_rest() const noexcept {
  bool there = velocity_.isZero(0);
  for (int a = 0; a < config_.actuators && config_.stop == StopAction::kRelax; ++a)
    there = there && (config_.follows_effort[a]
                          ? decision_.lambda[a] == rest_effort(a)
                          : std::abs(delta_a_[a] - rest_displacement(a)) < kArrived * config_.v_max[a]);
  return there;
}

/// Holds the effort, or lets it go to rest in such a time as the displacement would take for as much of its
/// range.
void Controller::brake_effort(int a, bool relax) noexcept {
  velocity_[a] = 0;
  if (!relax) return;
  const double cycles =
      (config_.l_max[a] - config_.l_min[a]) / (kRelaxShare * config_.v_max[a] * config_.period_s);
  const double step = (config_.a_max[a] - config_.a_min[a]) / std::max(cycles, 1.0);
  decision_.lambda[a] += std::clamp(rest_effort(a) - decision_.lambda[a], -step, step);
}

void Controller::brake(bool relax) noexcept {
  const double T = config_.period_s;
  for (int a = 0; a < config_.actuators; ++a) {
    if (config_.follows_effort[a]) {
      brake_effort(a, relax);
      continue;
    }
    const double deceleration = config_.v_max[a] / kRampTime;
    double wanted = 0;
    if (relax) {
      // The fastest speed from which steps of deceleration · T come to a halt at rest, not beyond it.
      const double way = rest_displacement(a) - delta_a_[a], distance = std::abs(way);
      const double stoppable = deceleration * (std::sqrt(T * T / 4 + 2 * distance / deceleration) - T / 2);
      wanted = std::copysign(std::min({kRelaxShare * config_.v_max[a], stoppable, distance / T}), way);
    }
    velocity_[a] = std::clamp(wanted, velocity_[a] - deceleration * T, velocity_[a] + deceleration * T);
    const double next = delta_a_[a] + velocity_[a] * T;
    if ((velocity_[a] > 0 && next > config_.l_max[a]) || (velocity_[a] < 0 && next < config_.l_min[a]))
      velocity_[a] = 0;
    else
      delta_a_[a] = next;
  }
}

}  // namespace tendril::rt
