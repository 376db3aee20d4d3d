// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/config/config.h"
#include "app/daemon/sample_errors.h"
#include "app/daemon/sensor_watch.h"
#include "app/robot/motion.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// The figures of a run that follow from its trace. Real-time: no, for all of it (allocates).
class RunStatistics {
 public:
  /// Keeps a reference to the configuration.
  explicit RunStatistics(const Config& config);

  /// One cycle, in order.
  /// @param motion  the path that is followed; nullptr where it is none but what an operator asks for
  void add(const rt::TraceRecord& record, const Motion* motion);

  /// Error of the tip when it was measured last, mm; nothing where it was not, on the path.
  std::optional<double> last_error_mm() const { return last_error_mm_; }

  // For summary.json, see docs/report.md.
  double running_s() const;  ///< from the first to the last cycle in which drives followed commands
  double bus_load() const;   ///< mean share of the bus that our frames needed at worst
  nlohmann::json tracking_error_mm() const;
  nlohmann::json model_error_mm() const;
  nlohmann::json target_to_model_mm() const;
  nlohmann::ordered_json effort_error() const;
  nlohmann::ordered_json following_error() const;
  nlohmann::ordered_json sensors() const;
  nlohmann::ordered_json qp() const;
  std::vector<std::string> warnings() const;  ///< faults that did not end the run, a sentence each

 private:
  /// From where the effector that moves is wanted to where the model puts it: needs no sensor.
  struct TargetToModel {
    double sum = 0, max = 0;  // m
    double max_at_s = 0;      // since the drives follow commands
    int64_t samples = 0;
  };

  void add_target_to_model(const rt::TraceRecord& record, const Motion* motion);

  const Config& config_;
  int effector_coordinates_ = 0;
  SampleErrors errors_;
  SensorWatch watch_;
  int64_t running_since_ns_ = 0, running_until_ns_ = 0;
  std::vector<double> tracking_mm_, model_mm_;
  std::vector<int> moving_rows_;  // of the coordinates that count for target_to_model_
  TargetToModel target_to_model_;
  std::vector<std::vector<double>> effort_errors_;  // N or Pa, one list an actuator
  std::vector<double> following_errors_;            // the largest of each actuator, m or m³
  std::optional<double> last_error_mm_;
  std::map<std::string, int64_t> statuses_;
  std::array<int64_t, rt::kFaultKinds> fault_cycles_{};
  int iterations_max_ = 0;
  int64_t bus_bits_ = 0;
};

}  // namespace tendril::app
