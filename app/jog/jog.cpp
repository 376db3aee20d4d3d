// SPDX-License-Identifier: Apache-2.0
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

Jog::Jog(const JogConfig& config) : config_(config) {
  decision_.command.axes = 1;
  decision_.lambda.setZero(1);
}

const rt::Decision& Jog::step(const hal::Measurement& measurement, const rt::Snapshot* /*snapshot*/,
                              const rt::Target* /*target*/, const rt::CycleInput& cycle) noexcept {
  using rt::Phase;
  ++cycles_;
  const Phase phase = decision_.phase;
  if (phase == Phase::kRunning || phase == Phase::kStopping) resume_delivered(cycle.undelivered);
  const bool stop = cycle.stop_requested;
  const bool driven = phase >= Phase::kEnabling && phase <= Phase::kStopping;
  const bool faulted = measurement.fault.kind != hal::FaultKind::kNone;
  if (faulted && phase < Phase::kDisabling) end(Ending::kDriveFault);
  if (faulted && ending_ == Ending::kDriveFault) {
    fault_ = measurement.fault;  // whose cause the drive may tell later
  } else if (driven && strays(measurement)) {
    end(Ending::kStrayed);
  }
  switch (decision_.phase) {
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
        enter(rt::Phase::kRunning);
      break;
    case Phase::kRunning:
      move(stop);
      break;
    case Phase::kStopping:
      if (static_cast<double>(cycles_) * config_.period_s >= kSettle_s) end(ending_);
      break;
    case Phase::kDisabling:
      if (measurement.finished || static_cast<double>(cycles_) * config_.period_s >= kDisable_s)
        enter(rt::Phase::kStopped);
      break;
    case Phase::kModelling:  // there is no model
    case Phase::kStandby:
    case Phase::kStopped:
      break;
  }
  return decision_;
}

void Jog::connect(const hal::Measurement& measurement) noexcept {
  start_ = delivered_ = decision_.command.displacement[0] = measurement.displacement[0];
  goal_ = start_ + config_.distance;
  const double slack = kSlack * (config_.greatest - config_.least);
  if (goal_ < config_.least - slack || goal_ > config_.greatest + slack) return end(Ending::kBeyond);
  decision_.command.enable = true;
  enter(rt::Phase::kEnabling);
}

/// A drive that has missed commands stands at the last one that it got. From there on the jog goes on from
/// rest.
void Jog::resume_delivered(bool undelivered) noexcept {
  double& position = decision_.command.displacement[0];
  if (!undelivered) {
    delivered_ = position;
    return;
  }
  position = delivered_;
  speed_ = 0;
  if (decision_.phase == rt::Phase::kStopping) enter(rt::Phase::kRunning);  // it has not arrived
}

/// A trapezoid of speed: never faster than can be braked in whole cycles on what is left of the way,
/// v (v/a + dt) / 2 = left.
void Jog::move(bool stop) noexcept {
  const double a = config_.speed / kRamp_s, dt = config_.period_s;
  double& position = decision_.command.displacement[0];
  const double left = std::abs(goal_ - position);
  if (stop) ending_ = Ending::kStopped;
  const double brakeable = a * (std::sqrt(dt * dt / 4 + 2 * left / a) - dt / 2);
  const double wanted = ending_ == Ending::kStopped ? 0 : std::min(config_.speed, brakeable);
  speed_ = std::clamp(wanted, std::max(0.0, speed_ - a * dt), speed_ + a * dt);
  if (ending_ == Ending::kStopped && speed_ <= 0) return enter(rt::Phase::kStopping);
  if (left <= std::max(speed_ * dt, a * dt * dt)) {
    position = goal_;
    return enter(rt::Phase::kStopping);
  }
  position += std::copysign(speed_ * dt, goal_ - position);
}

bool Jog::strays(const hal::Measurement& measurement) const noexcept {
  return !(std::abs(measurement.displacement[0] - decision_.command.displacement[0]) <= config_.lag);
}

void Jog::end(Ending ending) noexcept {
  ending_ = ending;
  decision_.command.enable = false;
  decision_.command.finish = true;
  enter(rt::Phase::kDisabling);
}

void Jog::enter(rt::Phase phase) noexcept {
  decision_.phase = phase;
  cycles_ = 0;
}

}  // namespace tendril::app
