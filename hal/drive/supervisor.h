// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hal/bus/bus.h"
#include "hal/drive/drives.h"
#include "hal/drive/master_config.h"
#include "hal/drive/other_master.h"
#include "hal/sensor/sensor_bank.h"

namespace tendril::hal {

/// What must be said of the power of drives at the end of a run, a sentence; empty where all have said that
/// theirs is off, or were never enabled. Real-time: no (allocates).
std::string describe_power(const MasterConfig& config, const Measurement& measurement);

/// What the masters of all protocols share: it listens for another controller, summarises the axes, checks
/// the bus, receives the sensors' frames and latches the first fault until it is cleared. Real-time: every
/// function but the constructor and `identifiers` (bounded, no allocation).
class Supervisor {
 public:
  /// @param config          outlives the supervisor
  /// @param controller_ids  see OtherMaster; empty where a protocol cannot tell another controller's frames
  Supervisor(const MasterConfig& config, const std::vector<uint32_t>& controller_ids)
      : feedback_timeout_ns_(config.feedback_timeout_ns),
        sensors_(config.sensors, config.start_timeout_ns),
        other_master_(controller_ids, config.listen_ns) {
    measurement_.axes = static_cast<int>(config.axes.size());
  }

  /// The identifiers of the sensors' frames, see marked_id. Real-time: no (allocates).
  std::vector<uint32_t> identifiers() const { return sensors_.identifiers(); }

  /// Processes a frame of a sensor or of another controller. @return whether it was one
  bool receive(const Frame& frame, int64_t arrival_ns) noexcept {
    return sensors_.receive(frame, arrival_ns) || other_master_.receive(frame, arrival_ns);
  }

  /// Whether the master may send: it has listened for long enough, and is the only one.
  bool may_send(int64_t now_ns) noexcept {
    return !other_master_.listening(now_ns) && !other_master_.heard();
  }

  /// Checks the time-outs of all axes and summarises the axes and the sensors.
  /// @tparam Axis         has supervise, position, position_stamp_ns, known, enabled, power, finished and
  /// fault,
  ///                      see Cia402Axis
  /// @param last_sync_ns  when the last SYNC was sent: a pause of the controller is no fault of the drives;
  ///                      `now_ns` where drives send their positions without SYNC
  /// @return              a measurement that is valid until the next call
  template <class Axis>
  const Measurement& measure(std::vector<Axis>& axes, BusHealth health, int64_t now_ns,
                             int64_t last_sync_ns) noexcept {
    Measurement& m = measurement_;
    m.stamp_ns = now_ns;
    m.all_known = m.all_enabled = m.all_disabled = m.finished = true;
    latch_bus(health, now_ns);
    if (other_master_.heard()) latch({.kind = FaultKind::kOtherMaster, .code = other_master_.heard_id()});
    for (int i = 0; i < m.axes; ++i) {
      Axis& axis = axes[i];
      axis.supervise(now_ns, last_sync_ns);
      m.displacement[i] = axis.position();
      m.displacement_stamp_ns[i] = axis.position_stamp_ns();
      m.all_known = m.all_known && axis.known(last_sync_ns);
      m.all_enabled = m.all_enabled && axis.enabled();
      m.power[i] = axis.power();
      if (m.power[i] == DrivePower::kOn && !reaches(health)) m.power[i] = DrivePower::kUnknown;
      m.all_disabled = m.all_disabled && m.power[i] == DrivePower::kOff;
      m.finished = m.finished && axis.finished();
      DriveFault fault = axis.fault();
      fault.axis = i;
      if (health == BusHealth::kStalled && is_silence(fault.kind)) fault = {.kind = FaultKind::kBusStalled};
      latch(fault);
    }
    if (m.all_enabled) other_master_.end();
    m.finished = m.finished || other_master_.heard();  // nothing was begun
    m.sensors = sensors_.judge(now_ns);
    return m;
  }

  /// Clears the latched fault, if there is one, and restarts the axes that have one.
  template <class Axis>
  void reset(std::vector<Axis>& axes) noexcept {
    if (!faulted()) return;
    measurement_.fault = {};
    if (other_master_.heard()) other_master_.restart();
    for (Axis& axis : axes)
      if (axis.fault().kind != FaultKind::kNone) axis.restart();
  }

  bool faulted() const noexcept { return measurement_.fault.kind != FaultKind::kNone; }

  /// The last result of `measure`.
  const Measurement& measurement() const noexcept { return measurement_; }

 private:
  static bool reaches(BusHealth health) noexcept {
    return health == BusHealth::kActive || health == BusHealth::kPassive;
  }
  static bool is_silence(FaultKind kind) noexcept {
    return kind == FaultKind::kHeartbeatLost || kind == FaultKind::kFeedbackLost;
  }
  void latch_bus(BusHealth health, int64_t now_ns) noexcept;
  void latch(const DriveFault& fault) noexcept;

  int64_t feedback_timeout_ns_;
  int64_t stalled_since_ns_ = 0;  // 0: the bus takes frames
  SensorBank sensors_;
  OtherMaster other_master_;
  Measurement measurement_;
};

}  // namespace tendril::hal
