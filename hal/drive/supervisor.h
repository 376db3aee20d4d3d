#pragma once

#include <vector>

#include "hal/bus/bus.h"
#include "hal/drive/drives.h"
#include "hal/drive/master_config.h"
#include "hal/sensor/sensor_bank.h"

namespace tendril::hal {

/// What the masters of all protocols share: it summarises the axes, checks the bus, receives the sensors'
/// frames and latches the first fault until it is cleared.
/// Real-time: every function but the constructor and `identifiers` (bounded, no allocation).
class Supervisor {
 public:
  /// @param config  outlives the supervisor
  explicit Supervisor(const MasterConfig& config) : sensors_(config.sensors, config.start_timeout_ns) {
    measurement_.axes = static_cast<int>(config.axes.size());
  }

  /// The identifiers of the sensors' frames, see marked_id. Real-time: no (allocates).
  std::vector<uint32_t> identifiers() const { return sensors_.identifiers(); }

  /// Processes a frame of a sensor. @return whether it was one
  bool receive_sensor(const Frame& frame, int64_t arrival_ns) noexcept {
    return sensors_.receive(frame, arrival_ns);
  }

  /// Checks the time-outs of all axes and summarises the axes and the sensors.
  /// @tparam Axis         has supervise, position, position_stamp_ns, known, enabled, disabled, finished and
  ///                      fault, see Cia402Axis
  /// @param last_sync_ns  when the last SYNC was sent: a pause of the controller is no fault of the drives;
  ///                      `now_ns` where drives send their positions without SYNC
  /// @return              a measurement that is valid until the next call
  template <class Axis>
  const Measurement& measure(std::vector<Axis>& axes, BusHealth health, int64_t now_ns,
                             int64_t last_sync_ns) noexcept {
    Measurement& m = measurement_;
    m.stamp_ns = now_ns;
    m.all_known = m.all_enabled = m.all_disabled = m.finished = true;
    latch_bus(health);
    for (int i = 0; i < m.axes; ++i) {
      Axis& axis = axes[i];
      axis.supervise(now_ns, last_sync_ns);
      m.displacement[i] = axis.position();
      m.displacement_stamp_ns[i] = axis.position_stamp_ns();
      m.all_known = m.all_known && axis.known(last_sync_ns);
      m.all_enabled = m.all_enabled && axis.enabled();
      m.all_disabled = m.all_disabled && axis.disabled();
      m.finished = m.finished && axis.finished();
      DriveFault fault = axis.fault();
      fault.axis = i;
      latch(fault);
    }
    m.sensors = sensors_.judge(now_ns);
    return m;
  }

  /// Clears the latched fault, if there is one, and restarts the axes that have one.
  template <class Axis>
  void reset(std::vector<Axis>& axes) noexcept {
    if (!faulted()) return;
    measurement_.fault = {};
    for (Axis& axis : axes)
      if (axis.fault().kind != FaultKind::kNone) axis.restart();
  }

  bool faulted() const noexcept { return measurement_.fault.kind != FaultKind::kNone; }

  /// The last result of `measure`.
  const Measurement& measurement() const noexcept { return measurement_; }

 private:
  void latch_bus(BusHealth health) noexcept;
  void latch(const DriveFault& fault) noexcept;

  SensorBank sensors_;
  Measurement measurement_;
};

}  // namespace tendril::hal
