// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/bus/frame_batch.h"
#include "hal/canopen/drive_names.h"
#include "hal/canopen/sdo_sequence.h"
#include "hal/cia402/cia402_power_control.h"
#include "hal/cia402/cia402_startup.h"
#include "hal/drive/drives.h"

namespace tendril::hal {

/// The master's view of one drive: its start-up, its power states and its supervision. Part of Cia402Master.
///
/// Cia402Startup brings the drive to NMT operational, Cia402PowerControl to "operation enabled". The axis
/// gives each its frames, lends both the one SDO client of the drive, and latches the first fault. Real-time:
/// every function but the constructor (bounded, no allocation).
class Cia402Axis {
 public:
  using Task = Cia402PowerControl::Task;

  /// @param config  outlives the axis
  /// Real-time: no (allocates).
  Cia402Axis(const AxisConfig& axis, const MasterConfig& config);

  /// Processes a frame if it belongs to this drive.
  void receive(const Frame& frame, int64_t arrival_ns) noexcept;

  /// Judges the time-outs.
  /// @param last_sync_ns  when the last SYNC was sent: where the controller paused, positions are not late
  void supervise(int64_t now_ns, int64_t last_sync_ns) noexcept;

  /// Appends the frames of start-up, of what precedes power, or of release: at most one of SDO and one of
  /// NMT.
  void set_up(int64_t now_ns, FrameBatch& out) noexcept;

  /// Appends the RPDO of this cycle, if the drive runs.
  /// @param may_begin    whether a drive that is off may begin to be enabled now
  /// @param all_enabled  whether every drive is, so that targets are followed
  void drive(Task task, bool may_begin, bool all_enabled, const AxisTarget& target, int64_t now_ns,
             FrameBatch& out) noexcept;

  /// Starts again from the communication reset.
  void restart() noexcept;

  /// Releases the drive as Cia402Startup::release does, as soon as the code of its fault is known. To be
  /// called until `finished`.
  void release() noexcept;

  /// Notes that the heartbeat of this master has been sent: drives begin to monitor it with the first one,
  /// and none is enabled before that.
  void on_heartbeat_sent() noexcept { monitors_us_ = monitors_us_ || startup_.synchronous(); }

  /// Whether set_up has more than a time-out to do, so that its turn matters.
  bool setting_up() const noexcept { return startup_.busy() || power_.transferring() || reads_error_code_; }

  /// Whether the drive wants SYNC.
  bool synchronous() const noexcept { return startup_.synchronous(); }

  /// Whether `release` is through, or was not needed.
  bool finished() const noexcept { return startup_.finished(); }

  /// Whether the drive runs, and its position was younger than the feedback timeout at the last SYNC.
  bool connected(int64_t last_sync_ns) const noexcept;

  /// Whether that position also counts from the reference.
  bool known(int64_t last_sync_ns) const noexcept { return connected(last_sync_ns) && power_.referenced(); }

  /// Whether the drive runs, and its homing procedure is what it lacks to have a reference.
  bool needs_homing() const noexcept { return startup_.running() && power_.needs_homing(); }

  /// Whether the drive was brought to "operation enabled" to follow targets and is there.
  bool enabled() const noexcept { return power_.enabled(); }

  /// What is known of its power stage.
  DrivePower power() const noexcept;

  /// What the drive calls itself; once known it stays as it is.
  const DriveNames& names() const noexcept { return startup_.names(); }

  /// Last known displacement, m or m³; 0 before the first.
  double position() const noexcept { return power_.displacement(); }

  /// When it arrived; 0 since the start or restart of the axis.
  int64_t position_stamp_ns() const noexcept { return power_.position_stamp_ns(); }

  /// The fault that took the axis out of operation, until restart.
  const DriveFault& fault() const noexcept { return fault_; }

 private:
  void on_emergency(uint16_t code) noexcept;
  void read_error_code(int64_t now_ns, FrameBatch& out) noexcept;
  void latch(const DriveFault& fault) noexcept;
  bool faulty() const noexcept { return fault_.kind != FaultKind::kNone; }

  const MasterConfig& config_;
  int node_;
  uint32_t tpdo_id_;
  SdoSequence sdo_;
  Cia402Startup startup_;
  Cia402PowerControl power_;
  bool monitors_us_ = false;
  bool reads_error_code_ = false;  // of a fault for which no EMCY has come
  DriveFault fault_;
};

}  // namespace tendril::hal
