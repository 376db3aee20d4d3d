#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/config/config.h"
#include "app/daemon/measured_signals.h"
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
  nlohmann::ordered_json effort_error() const;
  nlohmann::ordered_json following_error() const;
  nlohmann::ordered_json sensors() const;
  nlohmann::ordered_json qp() const;
  std::vector<std::string> warnings() const;  ///< faults that did not end the run, a sentence each

 private:
  struct ModelPoint {
    int64_t stamp_ns;
    rt::EffectorVector desired, p_e;
    rt::ActuatorVector lambda;
  };

  void add_tip_error(const rt::TraceRecord& record, const Motion* motion);
  void add_effort_errors(const rt::TraceRecord& record);
  const ModelPoint& model_at(int64_t stamp_ns) const;

  const Config& config_;
  MeasuredSignals signals_;
  NewSamples new_samples_;
  SensorWatch watch_;
  int effector_coordinates_;
  int64_t running_since_ns_ = 0, running_until_ns_ = 0;
  std::deque<ModelPoint> recent_;         // what the model held true, as long as a sample may refer to it
  std::array<int64_t, 3> compared_ns_{};  // last samples of the tip's coordinates that count
  std::vector<double> tracking_mm_, model_mm_;
  std::vector<std::vector<double>> effort_errors_;  // N or Pa, one list an actuator
  std::vector<double> following_errors_;            // the largest of each actuator, m or m³
  std::optional<double> last_error_mm_;
  std::map<std::string, int64_t> statuses_;
  std::array<int64_t, rt::kFaultKinds> fault_cycles_{};
  int iterations_max_ = 0;
  int64_t bus_bits_ = 0;
};

}  // namespace tendril::app
