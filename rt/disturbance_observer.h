// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "hal/drive/drives.h"
#include "rt/snapshot.h"

namespace tendril::rt {

/// Which reading measures an effector coordinate.
struct MeasuredCoordinate {
  int coordinate = 0;  ///< of the effectors
  int sensor = 0;      ///< index in SensorReadings::stamp_ns
  int signal = 0;      ///< index in SensorReadings::value, m
};

struct ObserverConfig {
  std::vector<MeasuredCoordinate> measured;  ///< each coordinate once at most; empty: nothing is corrected
  double period_s = 0;                       ///< of the control cycle
  double time_constant_s = 0.08;             ///< τ of the estimate
  double limit = 0.03;                       ///< m; a discrepancy beyond it is a sensor's mistake
};

/// Estimates what the model does not explain of where the effectors are: an output disturbance d, so that the
/// measured position is p_e + d. The QP then aims at r - d, which is offset-free for a constant error of the
/// model.
///
/// A sample y of age a is compared with the model at its exposure, not with the model now: p_e follows there
/// from the displacements that the drives measured, so that the lag of drives and bus is no disturbance. With
/// z = y - p_e, d follows z as a low-pass, d' = (z - d)/τ. This is an internal model control: with a perfect
/// model the loop has no delay in it, and it is stable for any delay if the gain of robot and model differ by
/// less than a factor of two [docs/feedback.md]. Nothing integrates r - y, so a target out of reach winds up
/// nothing.
///
/// A sensor may err: the median of three samples is taken, so that one alone counts for nothing; samples that
/// are not finite, beyond the limit, from the future or older than the history are refused; a sensor that
/// says the same while the model moves is frozen. Without samples d is kept for a while, then fades.
///
/// Real-time: every function but the constructor (bounded, no allocation).
class DisturbanceObserver {
 public:
  /// Real-time: no (allocates the history).
  DisturbanceObserver(const ObserverConfig& config, int effector_coordinates);

  /// One cycle: takes note of what the actuators do, and of new samples.
  /// @param lambda  efforts that the drives were told last, m, N or Pa
  void step(const hal::Measurement& measurement, const ActuatorVector& lambda, const Snapshot& snapshot,
            int64_t now_ns) noexcept;

  /// d, e, m or m³; 0 for coordinates that are not measured.
  const EffectorVector& disturbance() const noexcept { return d_; }

  /// Samples that were refused so far.
  int64_t refused() const noexcept { return refused_; }

 private:
  /// What moved the body in one cycle.
  struct Cause {
    int64_t stamp_ns = 0;  // of the measured displacements
    ActuatorVector lambda, delta_a;
  };
  /// A measured coordinate.
  struct Estimate {
    std::array<double, 3> z{};    // the last discrepancies, m
    int samples = 0;              // of them
    double y = NAN, p_since = 0;  // the last value, and where the model was when it came first
    bool frozen = false;
    bool trusted = false;    // there is a discrepancy to follow
    int64_t trusted_ns = 0;  // when the last one came
  };

  void remember(const hal::Measurement& measurement, const ActuatorVector& lambda) noexcept;
  bool recall(int64_t stamp_ns, const Snapshot& snapshot) noexcept;
  bool take(Estimate& estimate, double y, double p) noexcept;
  const Cause& cause(std::size_t k) const noexcept { return causes_[(first_ + k) % causes_.size()]; }

  ObserverConfig config_;
  double share_, faded_;              // of d in one cycle: taken from the discrepancy; left where it fades
  std::vector<Cause> causes_;         // a ring
  std::size_t first_ = 0, kept_ = 0;  // its oldest entry, and how many there are
  std::vector<Estimate> estimates_;   // one a measured coordinate
  std::array<int64_t, hal::kMaxSensors> known_ns_{};
  EffectorVector p_e_;  // the model's at an exposure
  EffectorVector d_;
  int64_t refused_ = 0;
};

}  // namespace tendril::rt
