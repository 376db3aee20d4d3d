// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "app/config/config.h"
#include "app/daemon/measured_signals.h"
#include "app/robot/motion.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// How far what sensors tell is from what was wanted and from the model, each sample at its own instant,
/// while the drives follow their commands. Real-time: no, for all of it (allocates).
class SampleErrors {
 public:
  /// Of the first effector, in the coordinates that are controlled and measured.
  struct Tip {
    int64_t stamp_ns;          ///< of the newest sample in it
    double to_path, to_model;  ///< distances, m
  };
  struct Effort {
    std::size_t actuator;
    double error;  ///< without its sign, N or Pa
  };

  /// Keeps a reference to the configuration.
  explicit SampleErrors(const Config& config);

  /// One cycle, in order.
  /// @param motion  the path that is followed; nullptr where it is none but what an operator asks for
  void add(const rt::TraceRecord& record, const Motion* motion);

  const std::optional<Tip>& tip() const { return tip_; }           ///< new in the last cycle
  const std::vector<Effort>& efforts() const { return efforts_; }  ///< likewise
  const MeasuredSignals& signals() const { return signals_; }

 private:
  struct ModelPoint {
    int64_t stamp_ns;
    rt::EffectorVector desired, p_e;
    rt::ActuatorVector lambda;
  };

  void compare_tip(const rt::TraceRecord& record, const Motion* motion);
  void compare_efforts(const rt::TraceRecord& record);
  const ModelPoint& model_at(int64_t stamp_ns) const;

  const Config& config_;
  MeasuredSignals signals_;
  NewSamples new_samples_;
  int effector_coordinates_;
  int64_t running_since_ns_ = 0;
  std::deque<ModelPoint> recent_;         // what the model held true, as long as a sample may refer to it
  std::array<int64_t, 3> compared_ns_{};  // last samples of the tip's coordinates that count
  std::optional<Tip> tip_;
  std::vector<Effort> efforts_;
};

}  // namespace tendril::app
