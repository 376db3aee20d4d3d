// SPDX-License-Identifier: Apache-2.0
#include "rt/disturbance_observer.h"

#include <algorithm>
#include <cmath>

namespace tendril::rt {
namespace {

// Samples that are older when they arrive are refused.
constexpr double kHistory_s = 0.25;
// Without samples, d is kept for so long, then fades with this time constant.
constexpr int64_t kKept_ns = 500'000'000;
constexpr double kFading_s = 1;
// A sensor that says the same while the model moves by this is frozen.
constexpr double kFrozenWay = 0.5e-3;  // m

double median(const std::array<double, 3>& z) noexcept {
  return std::max(std::min(z[0], z[1]), std::min(std::max(z[0], z[1]), z[2]));
}

}  // namespace

DisturbanceObserver::DisturbanceObserver(const ObserverConfig& config, int effector_coordinates)
    : config_(config),
      share_(1 - std::exp(-config.period_s / config.time_constant_s)),
      faded_(std::exp(-config.period_s / kFading_s)),
      estimates_(config.measured.size()) {
  p_e_.setZero(effector_coordinates);
  d_.setZero(effector_coordinates);
  if (!config.measured.empty())
    causes_.resize(static_cast<std::size_t>(std::ceil(kHistory_s / config.period_s)) + 2);
}

void DisturbanceObserver::step(const hal::Measurement& measurement, const ActuatorVector& lambda,
                               const Snapshot& snapshot, int64_t now_ns) noexcept {
  if (causes_.empty()) return;
  remember(measurement, lambda);
  const hal::SensorReadings& readings = measurement.sensors;
  int64_t recalled_ns = 0;  // p_e_ is of this instant
  for (std::size_t k = 0; k < estimates_.size(); ++k) {
    const MeasuredCoordinate& measured = config_.measured[k];
    Estimate& estimate = estimates_[k];
    const int64_t stamp_ns = readings.stamp_ns[measured.sensor];
    if (stamp_ns > known_ns_[measured.sensor]) {
      const bool there = stamp_ns == recalled_ns || (stamp_ns <= now_ns && recall(stamp_ns, snapshot));
      if (there) recalled_ns = stamp_ns;
      if (there && take(estimate, readings.value[measured.signal], p_e_[measured.coordinate]))
        estimate.trusted_ns = now_ns;
      else
        ++refused_;
    }
    double& d = d_[measured.coordinate];
    if (estimate.trusted && now_ns - estimate.trusted_ns <= kKept_ns)
      d += share_ * (median(estimate.z) - d);
    else if (now_ns - estimate.trusted_ns > kKept_ns)
      d *= faded_;
  }
  for (std::size_t s = 0; s < known_ns_.size();
       ++s)  // a stamp that runs ahead of the clock is no measure for later ones
    known_ns_[s] = std::max(known_ns_[s], std::min(readings.stamp_ns[s], now_ns));
}

/// The displacements of a cycle, with the efforts that go with them.
void DisturbanceObserver::remember(const hal::Measurement& measurement,
                                   const ActuatorVector& lambda) noexcept {
  int64_t stamp_ns = measurement.stamp_ns;
  for (int a = 0; a < measurement.axes; ++a)
    stamp_ns = std::min(stamp_ns, measurement.displacement_stamp_ns[a]);
  if (kept_ > 0 && stamp_ns <= cause(kept_ - 1).stamp_ns) return;  // nothing new
  if (kept_ == causes_.size())
    first_ = (first_ + 1) % causes_.size();
  else
    ++kept_;
  Cause& newest = causes_[(first_ + kept_ - 1) % causes_.size()];
  newest.stamp_ns = stamp_ns;
  newest.lambda = lambda;
  newest.delta_a = Eigen::Map<const ActuatorVector>(measurement.displacement.data(), lambda.size());
}

/// Computes p_e_ of an instant, from the causes before and after it:
///   p_e = p_e_free + W_ea λ + G_ea (δ_a - W_aa λ - δ_a_free).
/// @return  false where the history does not reach back to it
bool DisturbanceObserver::recall(int64_t stamp_ns, const Snapshot& snapshot) noexcept {
  if (kept_ == 0 || stamp_ns < cause(0).stamp_ns) return false;
  std::size_t before = 0,
              after = kept_ - 1;  // a sample that is younger than the drives' is compared with these
  if (stamp_ns >= cause(after).stamp_ns) before = after;
  while (after - before > 1) {
    const std::size_t middle = (before + after) / 2;
    (cause(middle).stamp_ns <= stamp_ns ? before : after) = middle;
  }
  const Cause &a = cause(before), &b = cause(after);
  const double way_ns = static_cast<double>(b.stamp_ns - a.stamp_ns);
  const double share = way_ns > 0 ? static_cast<double>(stamp_ns - a.stamp_ns) / way_ns : 0;
  const ActuatorVector lambda = a.lambda + share * (b.lambda - a.lambda);
  const ActuatorVector beyond =
      a.delta_a + share * (b.delta_a - a.delta_a) - snapshot.W_aa * lambda - snapshot.delta_a_free;
  p_e_ = snapshot.p_e_free;
  p_e_.noalias() += snapshot.W_ea * lambda;
  p_e_.noalias() += snapshot.G_ea * beyond;
  return p_e_.allFinite();
}

/// A sample of a coordinate. @return  whether it counts
bool DisturbanceObserver::take(Estimate& estimate, double y, double p) noexcept {
  if (!std::isfinite(y) || std::abs(y - p) > config_.limit) return false;
  if (y != estimate.y) {
    estimate.y = y;
    estimate.p_since = p;
    estimate.frozen = false;
  }
  if (std::abs(p - estimate.p_since) > kFrozenWay) {
    estimate.frozen = true;
    estimate.trusted = false;
    estimate.samples = 0;
  }
  if (estimate.frozen) return false;
  estimate.z[static_cast<std::size_t>(estimate.samples % 3)] = y - p;
  estimate.trusted = ++estimate.samples >= 3;
  if (estimate.samples == 6) estimate.samples = 3;  // counts on, without end
  return true;
}

}  // namespace tendril::rt
