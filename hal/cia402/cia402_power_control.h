// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hal/bus/frame.h"
#include "hal/canopen/sdo_sequence.h"
#include "hal/cia402/cia402.h"
#include "hal/cia402/cia402_settings.h"
#include "hal/cia402/cia402_setup.h"
#include "hal/drive/drives.h"
#include "hal/drive/following_monitor.h"
#include "hal/drive/master_config.h"
#include "hal/drive/range_monitor.h"

namespace tendril::hal {

/// Brings one drive, which is in NMT operational, to "operation enabled" and back, commands it, homes it and
/// monitors its TPDO. Part of Cia402Axis.
///
/// A task says what the drive shall do, and a phase how far its power stage has followed: off; preparing (SDO
/// transfers without power); enabling (controlwords); confirming (it has power and holds its position until
/// it shows its mode); on. Functions that can find a fault return it; of kind kNone: none. Call `stop` after
/// a fault. Real-time: every function but the constructor (bounded, no allocation).
class Cia402PowerControl {
 public:
  enum class Task : uint8_t {
    kDisable,
    kHome,   // the homing procedure of the drive
    kFollow  // the targets of the controller
  };

  /// @param config  outlives the object
  /// Real-time: no (allocates).
  Cia402PowerControl(const AxisConfig& axis, const MasterConfig& config);

  /// Processes a TPDO.
  DriveFault on_feedback(const DriveFeedback& feedback, int64_t arrival_ns) noexcept;

  /// Processes the error code of an EMCY; 0: the error is gone. @return a fault where the drive has power
  DriveFault on_emergency(uint16_t code) noexcept;

  /// Judges the time-outs.
  /// @param running_since_ns  when the drive became NMT operational
  /// @param last_sync_ns      when the last SYNC was sent
  DriveFault supervise(int64_t now_ns, int64_t running_since_ns, int64_t last_sync_ns) const noexcept;

  /// Goes on with the SDO transfers of enabling. Only while `transferring`.
  DriveFault transfer(int64_t now_ns, SdoSequence& sdo, FrameBatch& out) noexcept;

  /// Decides the controlword of this cycle and may begin SDO transfers. Only where the position is known.
  /// @param faulty       the axis has a fault: it is disabled with any task
  /// @param may_begin    whether a drive that is off may begin to be enabled now
  /// @param all_enabled  whether every drive is, so that targets are followed
  /// @return             the RPDO
  Frame command(Task task, bool faulty, bool may_begin, bool all_enabled, const AxisTarget& target,
                int64_t now_ns, SdoSequence& sdo) noexcept;

  /// Ends enabling and homing, as after a fault; the next `command` begins to disable the drive.
  void stop() noexcept;

  /// Starts again with nothing known of the drive.
  void restart() noexcept;

  bool transferring() const noexcept { return phase_ == Phase::kPreparing || phase_ == Phase::kConfirming; }

  /// The last error code that an EMCY brought; 0: none, or the error is gone.
  uint16_t emergency() const noexcept { return emergency_; }

  /// Whether the drive was brought to "operation enabled" to follow targets and is there.
  bool enabled() const noexcept { return phase_ == Phase::kOn && task_ == Task::kFollow; }

  /// Whether the drive has been enabled, and has not said since that its power stage is off.
  bool may_be_on() const noexcept { return may_be_on_; }

  /// Takes the word of the drive, which came otherwise, that its power stage is off.
  void confirm_off() noexcept { may_be_on_ = false; }

  /// Whether the position counts from the reference.
  bool referenced() const noexcept { return referenced_; }

  /// Whether a homing procedure is what the drive lacks to have a reference.
  bool needs_homing() const noexcept { return reference_ == Reference::kHoming && !referenced_; }

  /// Last known position as a displacement, m or m³; 0 before the first.
  double displacement() const noexcept { return scale_.to_displacement(position_); }

  /// When it arrived; 0 where the position is not known.
  int64_t position_stamp_ns() const noexcept { return position_stamp_ns_; }

 private:
  enum class Phase : uint8_t { kOff, kPreparing, kEnabling, kConfirming, kOn };

  DriveFault monitor_reference() noexcept;
  DriveFault monitor_power() noexcept;
  DriveFault monitor_motion() noexcept;
  bool says_it_follows() noexcept;
  bool power_is_off() const noexcept;
  DriveFault judge_homing(int64_t arrival_ns) noexcept;
  DriveFault confirm_mode(SdoSequence::Status status, int64_t now_ns, SdoSequence& sdo) noexcept;
  void begin_following() noexcept;
  void begin_enabling(int64_t now_ns, SdoSequence& sdo) noexcept;
  uint16_t next_word(bool faulty, int64_t now_ns) noexcept;
  uint16_t enabling_word(int64_t now_ns) noexcept;
  Frame rpdo(bool all_enabled, const AxisTarget& target) noexcept;

  const MasterConfig& config_;
  uint32_t rpdo_id_;
  AxisScale scale_;
  bool follows_effort_;
  double rated_torque_;  // Nm
  RangeMonitor range_;
  FollowingMonitor following_monitor_;
  std::vector<SdoStep> homing_steps_, following_steps_, homing_mode_, following_mode_;
  std::optional<SoftLimits> soft_limits_;
  Reference reference_;
  uint16_t referenced_mask_;  // of the statusword; 0: the drive has no such bit
  int64_t homing_timeout_ns_;

  Task task_ = Task::kDisable;
  Phase phase_ = Phase::kOff;
  int64_t enabling_since_ns_ = 0;
  bool asks_mode_ = false;           // while confirming
  bool awaits_start_state_ = false;  // the drive shall be enabled, but is in no state to begin from
  bool clearing_fault_ = false;      // the drive was in fault when enabling began
  int64_t reset_edge_ns_ = 0;
  bool following_ = false;              // targets of the controller rather than the position at enabling
  bool may_be_on_ = false;              // its power stage
  bool target_counts_ = false;          // the drive is in "operation enabled" as this master brought it there
  bool has_followed_ = false;           // the drive has set the bit that says so since it is enabled
  int64_t not_following_since_ns_ = 0;  // by its statusword; 0: it follows

  bool referenced_ = false;      // the position counts from the reference
  int64_t homing_since_ns_ = 0;  // 0: the procedure has not been started

  DriveState state_ = DriveState::kUnknown;
  uint16_t statusword_ = 0, controlword_ = 0;
  int32_t position_ = 0, target_ = 0;  // counts
  int16_t torque_ = 0;                 // thousandths of the rated one
  int64_t position_stamp_ns_ = 0;      // 0: position unknown
  uint16_t emergency_ = 0;             // last error code
};

}  // namespace tendril::hal
