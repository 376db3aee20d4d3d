#include "app/jog/jog.h"

#include <algorithm>
#include <cmath>

namespace tendril::app {
namespace {

constexpr double kRamp_s = 0.25;    // from rest to speed
constexpr double kSettle_s = 0.3;   // for the axis to arrive behind its command
constexpr double kDisable_s = 2.0;  // for the drive to let go
// Of the range: what rounding may put beyond it.
constexpr double kSlack = 1e-9;

}  // namespace

Jog::Jog(const JogConfig& config) : config_(config) { command_.axes = 1; }

const hal::Command& Jog::step(const hal::Measurement& measurement, bool stop) noexcept {
  ++cycles_;
  const bool driven = phase_ == Phase::kEnabling || phase_ == Phase::kMoving || phase_ == Phase::kSettling;
  const bool faulted = measurement.fault.kind != hal::FaultKind::kNone;
  if (faulted && phase_ < Phase::kDisabling) end(Ending::kDriveFault);
  if (faulted && ending_ == Ending::kDriveFault) {
    fault_ = measurement.fault;  // whose cause the drive may tell later
  } else if (driven && out_of_hand(measurement)) {
    end(Ending::kStrayed);
  }
  switch (phase_) {
    case Phase::kConnecting:
      if (stop)
        end(Ending::kStopped);
      else if (measurement.all_known)
        connect(measurement);
      break;
    case Phase::kEnabling:
      if (stop)
        end(Ending::kStopped);
      else if (measurement.all_enabled)
        enter(Phase::kMoving);
      break;
    case Phase::kMoving:
      move(stop);
      break;
    case Phase::kSettling:
      if (static_cast<double>(cycles_) * config_.period_s >= kSettle_s) end(ending_);
      break;
    case Phase::kDisabling:
      if (measurement.finished || static_cast<double>(cycles_) * config_.period_s >= kDisable_s)
        enter(Phase::kDone);
      break;
    case Phase::kDone:
      break;
  }
  return command_;
}

void Jog::connect(const hal::Measurement& measurement) noexcept {
  start_ = command_.position[0] = measurement.position[0];
  goal_ = start_ + config_.distance;
  const double slack = kSlack * (config_.greatest - config_.least);
  if (goal_ < config_.least - slack || goal_ > config_.greatest + slack) return end(Ending::kBeyond);
  command_.enable = true;
  enter(Phase::kEnabling);
}

/// A trapezoid of speed: never faster than can be braked in whole cycles on what is left of the way,
/// v (v/a + dt) / 2 = left.
void Jog::move(bool stop) noexcept {
  const double a = config_.speed / kRamp_s, dt = config_.period_s;
  double& position = command_.position[0];
  const double left = std::abs(goal_ - position);
  if (stop) ending_ = Ending::kStopped;
  const double brakeable = a * (std::sqrt(dt * dt / 4 + 2 * left / a) - dt / 2);
  const double wanted = ending_ == Ending::kStopped ? 0 : std::min(config_.speed, brakeable);
  speed_ = std::clamp(wanted, std::max(0.0, speed_ - a * dt), speed_ + a * dt);
  if (ending_ == Ending::kStopped && speed_ <= 0) return enter(Phase::kSettling);
  if (left <= std::max(speed_ * dt, a * dt * dt)) {
    position = goal_;
    return enter(Phase::kSettling);
  }
  position += std::copysign(speed_ * dt, goal_ - position);
}

bool Jog::out_of_hand(const hal::Measurement& measurement) const noexcept {
  return !(std::abs(measurement.position[0] - command_.position[0]) <= config_.lag);
}

void Jog::end(Ending ending) noexcept {
  ending_ = ending;
  command_.enable = false;
  command_.finish = true;
  enter(Phase::kDisabling);
}

void Jog::enter(Phase phase) noexcept {
  phase_ = phase;
  cycles_ = 0;
}

}  // namespace tendril::app
