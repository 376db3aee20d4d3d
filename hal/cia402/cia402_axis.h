#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hal/bus/frame_batch.h"
#include "hal/canopen/canopen.h"
#include "hal/canopen/drive_names.h"
#include "hal/canopen/emergency.h"
#include "hal/canopen/sdo_sequence.h"
#include "hal/cia402/cia402.h"
#include "hal/cia402/cia402_settings.h"
#include "hal/cia402/cia402_setup.h"
#include "hal/drive/drives.h"
#include "hal/drive/range_watch.h"

namespace tendril::hal {

/// The master's view of one drive: its start-up, its power states and its supervision. Part of Cia402Master.
///
/// Stages: reset communication, wait for boot-up, identify (once) and configure over SDO, start, run; at the
/// end release. Within the running stage a task says what the drive shall have its power for, and a phase how
/// far it has followed.
/// Real-time: every function but the constructor (bounded, no allocation).
class Cia402Axis {
 public:
  /// What a drive has its power for.
  enum class Task : uint8_t {
    kRest,   // none: it is disabled
    kHome,   // its own homing procedure
    kFollow  // our targets
  };

  /// @param config  outlives the axis
  /// Real-time: no (allocates).
  Cia402Axis(const AxisConfig& axis, const MasterConfig& config);

  /// Takes in a frame if it is one of this drive's.
  void receive(const Frame& frame, int64_t arrival_ns) noexcept;

  /// Judges the time-outs.
  /// @param synced_ns  when the drive was last asked for its position: a pause of ours is no fault of its own
  void supervise(int64_t now_ns, int64_t synced_ns) noexcept;

  /// Appends the frames of start-up, of what precedes power, or of release: at most one of SDO and one of
  /// NMT.
  void set_up(int64_t now_ns, FrameBatch& out) noexcept;

  /// Appends the RPDO of this cycle, if the drive runs.
  /// @param may_begin    whether a drive at rest may begin to be enabled now
  /// @param all_enabled  whether every drive is, so that targets are followed
  void drive(Task task, bool may_begin, bool all_enabled, const AxisTarget& target, int64_t now_ns,
             FrameBatch& out) noexcept;

  /// Starts afresh from the communication reset, whatever the axis did.
  void restart() noexcept;

  /// Takes the drive, which is disabled, out of operation and ends its watch on us, as soon as it has told
  /// what its fault is. To be called until `finished`.
  void release(FrameBatch& out) noexcept;

  /// Whether set_up has more than a time-out to do, so that its turn matters.
  bool setting_up() const noexcept;

  /// Whether the drive wants SYNC.
  bool synchronous() const noexcept { return stage_ == Stage::kStarting || stage_ == Stage::kRunning; }

  /// Whether `release` is through, or was not needed.
  bool finished() const noexcept { return stage_ == Stage::kFinished; }

  /// Whether the drive runs, and its position was, when last asked for, younger than the feedback timeout.
  bool connected(int64_t synced_ns) const noexcept;

  /// Whether that position also counts from the reference.
  bool known(int64_t synced_ns) const noexcept { return connected(synced_ns) && referenced_; }

  /// Whether the drive runs, and its homing procedure is what it lacks to have a reference.
  bool needs_homing() const noexcept;

  /// Whether the drive was brought to "operation enabled" to follow targets and is there.
  bool enabled() const noexcept { return phase_ == Phase::kOn && task_ == Task::kFollow; }

  /// Whether nothing is known that says the drive holds torque.
  bool disabled() const noexcept;

  /// What the drive calls itself; once known it stays as it is.
  const DriveNames& names() const noexcept { return names_; }

  /// Last known displacement, m or m³; 0 before the first.
  double position() const noexcept;

  /// When it arrived; 0 since the start or restart of the axis.
  int64_t position_stamp_ns() const noexcept { return position_stamp_ns_; }

  /// The fault that took the axis out of operation, until restart.
  const DriveFault& fault() const noexcept { return fault_; }

 private:
  enum class Stage : uint8_t {
    kReset,
    kBooting,
    kIdentifying,
    kConfiguring,
    kStarting,
    kRunning,
    kReleasing,
    kFinished,
    kFailed
  };
  enum class Phase : uint8_t { kOff, kPreparing, kEnabling, kOn };  // kPreparing: over SDO, without power

  void on_heartbeat(NmtState state, int64_t arrival_ns) noexcept;
  void on_emergency(const Emergency& emergency) noexcept;
  void on_feedback(const DriveFeedback& feedback, int64_t arrival_ns) noexcept;
  void watch_reference() noexcept;
  void judge_homing(int64_t arrival_ns) noexcept;
  void configure() noexcept;
  void ask_error_code(int64_t now_ns, FrameBatch& out) noexcept;
  void begin(int64_t now_ns) noexcept;
  uint16_t enabling_word(int64_t now_ns) noexcept;
  Frame command_frame(bool all_enabled, const AxisTarget& target) noexcept;
  void fail(FaultKind kind, uint32_t code) noexcept;
  void fail_setup() noexcept;
  void fail_sdo(FaultKind kind, uint32_t code, ObjectAddress object, uint32_t expected) noexcept;

  const MasterConfig& config_;
  int node_;
  uint32_t rpdo_id_, tpdo_id_;
  AxisScale scale_;
  bool follows_effort_;
  double rated_torque_;  // Nm
  RangeWatch range_;
  std::vector<SdoStep> setup_steps_, homing_steps_, following_steps_, release_steps_;
  std::optional<SoftLimits> soft_limits_;
  Reference reference_;
  uint16_t referenced_mask_;  // of the statusword; 0: the drive has no such bit
  int64_t homing_timeout_ns_;
  SdoSequence sdo_;
  DriveNames names_;

  Stage stage_ = Stage::kReset;
  int64_t stage_since_ns_ = 0;
  bool may_watch_us_ = false;  // for all we know
  int64_t last_nmt_start_ns_ = 0;
  NmtState nmt_ = NmtState::kBootUp;
  int64_t heartbeat_ns_ = 0;  // arrival of the last one

  Task task_ = Task::kRest;
  Phase phase_ = Phase::kOff;
  int64_t enabling_since_ns_ = 0;
  bool awaits_rest_ = false;     // the drive shall be enabled, but is in no state to begin from
  bool clearing_fault_ = false;  // the drive was in fault when enabling began
  int64_t reset_edge_ns_ = 0;
  bool following_ = false;  // targets of the controller rather than the position at enabling

  bool referenced_ = false;      // the position counts from the reference
  int64_t homing_since_ns_ = 0;  // 0: the procedure has not been started

  DriveState state_ = DriveState::kUnknown;
  uint16_t statusword_ = 0, controlword_ = 0;
  int32_t position_ = 0, target_ = 0;  // counts
  int16_t torque_ = 0;                 // thousandths of the rated one
  int64_t position_stamp_ns_ = 0;      // 0: position unknown
  uint16_t emergency_ = 0;             // last error code
  bool asks_error_code_ = false;       // of a fault for which no EMCY has come
  DriveFault fault_;
};

}  // namespace tendril::hal
