#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/config/config.h"
#include "app/daemon/sensor_watch.h"
#include "app/robot/motion.h"
#include "rt/control_loop.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// Facts of a run that the trace does not hold.
struct RunFacts {
  int nodes = 0, tetrahedra = 0;
  std::string bus;
  bool memory_locked = false;
  int iteration_cap = 0;  ///< of the QP
  std::uint64_t model_refreshes = 0;
  double model_seconds = 0;         ///< from the first to the last refresh
  std::uint64_t trace_dropped = 0;  ///< records that found the ring full
  std::uint64_t bus_dropped = 0;    ///< frames that found a queue full
  std::string stop_reason;          ///< empty where the run ended as asked
};

/// Keeps the record of a run: the trace as CSV while it goes on, the figures in summary.json at its end.
/// docs/report.md describes both files.
class RunRecorder {
 public:
  /// Makes the folder and opens DIR/trace.csv.
  /// @throws std::runtime_error where the folder cannot be written
  RunRecorder(const Config& config, const std::filesystem::path& directory);

  /// One cycle, in order.
  /// @param motion  the path that is followed, once it is
  void add(const rt::TraceRecord& record, const Motion* motion);

  /// Error of the tip when it was measured last, mm; nothing where it was not, on the path.
  std::optional<double> last_error_mm() const { return last_error_mm_; }

  /// Closes the trace and writes DIR/summary.json.
  void finish(const RunFacts& facts, const rt::LoopCounts& counts);

 private:
  struct ModelPoint {
    std::int64_t stamp_ns;
    rt::EffectorVector p_e;
    rt::ActuatorVector lambda;
  };

  /// Where what a sensor measures stands among the readings.
  struct Reading {
    std::size_t sensor, signal;
  };

  /// A coordinate of an effector other than the first.
  struct OtherReading {
    Reading reading;
    std::string column;
  };

  void place_readings(const Config& config);
  void write_header();
  void write_row(const rt::TraceRecord& record, const Motion* motion);
  std::string tip_cells(const rt::TraceRecord& record) const;
  std::string cell(const rt::TraceRecord& record, const std::optional<Reading>& reading, int decimals) const;
  bool is_new(const rt::TraceRecord& record, const Reading& reading) const;
  void judge_tip(const rt::TraceRecord& record, const Motion& motion);
  void judge_efforts(const rt::TraceRecord& record);
  const ModelPoint& model_at(std::int64_t stamp_ns) const;

  const Config& config_;
  std::filesystem::path directory_;
  std::ofstream csv_;
  std::vector<int> tip_axes_;  // axes of the first effector's controlled coordinates, in their order
  int effector_coordinates_;
  std::array<std::optional<Reading>, 3> tip_;    // x, y, z of the first effector
  std::vector<std::optional<Reading>> efforts_;  // one an actuator
  std::vector<OtherReading> others_;
  std::array<std::int64_t, hal::kMaxSensors> known_ns_{};  // of each sensor's last sample
  SensorWatch watch_;
  std::int64_t first_ns_ = 0, last_ns_ = 0, running_since_ns_ = 0, running_until_ns_ = 0;
  std::deque<ModelPoint> recent_;            // what the model held true, as long as a sample may refer to it
  std::array<std::int64_t, 3> judged_ns_{};  // of the tip's coordinates
  std::vector<double> tracking_mm_, model_mm_;
  std::vector<std::vector<double>> effort_errors_;  // N or Pa, one list an actuator
  std::optional<double> last_error_mm_;
  std::map<std::string, std::int64_t> statuses_;
  std::array<std::int64_t, rt::kFaultKinds> fault_cycles_{};
  int iterations_max_ = 0;
  std::int64_t bus_bits_ = 0;
};

}  // namespace tendril::app
