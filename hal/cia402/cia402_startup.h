// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hal/bus/frame_batch.h"
#include "hal/canopen/canopen.h"
#include "hal/canopen/drive_names.h"
#include "hal/canopen/sdo_sequence.h"
#include "hal/drive/drives.h"
#include "hal/drive/master_config.h"

namespace tendril::hal {

/// The fault of an SDO sequence that has failed: the refused object and the abort code, or the object that
/// showed another value. Real-time: yes.
DriveFault fault_of_failed(const SdoSequence& sdo) noexcept;

/// Brings one drive from a reset of its communication to NMT operational, and at the end back. Part of
/// Cia402Axis.
///
/// Stages: reset communication, wait for boot-up, ask whether the drive answers, identify (once) and
/// configure over SDO, NMT start, running; at the end check that the power is off, and release. All SDO
/// transfers but those that read the names go through the SdoSequence of the axis. Functions that can find a
/// fault return it; of kind kNone: none. Real-time: every function but the constructor (bounded, no
/// allocation).
class Cia402Startup {
 public:
  /// @param config  outlives the object
  /// Real-time: no (allocates).
  Cia402Startup(const AxisConfig& axis, const MasterConfig& config);

  /// Processes a heartbeat or boot-up message.
  DriveFault on_heartbeat(NmtState state, int64_t arrival_ns, SdoSequence& sdo) noexcept;

  /// Processes an SDO answer.
  void on_sdo_answer(const SdoAnswer& answer, SdoSequence& sdo) noexcept;

  /// Judges the heartbeat, and the time that the NMT start takes. Only where the drive is `synchronous`.
  DriveFault supervise(int64_t now_ns) const noexcept;

  /// Goes on, where the drive is not running: at most one frame of SDO and one of NMT.
  DriveFault advance(int64_t now_ns, SdoSequence& sdo, FrameBatch& out) noexcept;

  /// Starts again from the reset of communication.
  void restart() noexcept {
    stage_ = Stage::kReset;
    power_is_off_ = power_is_on_ = false;
  }

  /// Stays where it is until `restart`.
  void give_up() noexcept { stage_ = Stage::kFailed; }

  /// Switches the power of the drive off over SDO. Where it says so, and is `ours`, takes the drive out of
  /// NMT operational and ends its heartbeat consumer; any other drive goes on monitoring us, and stops by
  /// itself. To be called until `finished`.
  /// @param ours       the set-up of the drive is still the one that this master made
  /// @param may_be_on  the drive has been enabled, before a restart too, and has not said since that it is
  /// off
  void release(bool ours, bool may_be_on, SdoSequence& sdo) noexcept;

  /// Whether `advance` has more than a time-out to do.
  bool busy() const noexcept;

  /// Whether the drive wants SYNC.
  bool synchronous() const noexcept { return stage_ == Stage::kStarting || running(); }

  /// Whether the drive is in NMT operational.
  bool running() const noexcept { return stage_ == Stage::kRunning; }

  /// Since when it is running, or in another stage.
  int64_t stage_since_ns() const noexcept { return stage_since_ns_; }

  /// Whether the drive has told, over SDO in set-up or release, that its power is off.
  bool power_is_off() const noexcept { return power_is_off_; }

  /// Whether it has told in release that its power is on.
  bool power_is_on() const noexcept { return power_is_on_; }

  /// Whether `release` is through, or was not needed.
  bool finished() const noexcept { return stage_ == Stage::kFinished; }

  /// What the drive calls itself; once known it stays as it is.
  const DriveNames& names() const noexcept { return names_; }

 private:
  enum class Stage : uint8_t {
    kReset,
    kBooting,
    kAsking,
    kIdentifying,
    kConfiguring,
    kStarting,
    kRunning,
    kCheckingPower,
    kReleasing,
    kFinished,
    kFailed
  };

  DriveFault ask(int64_t now_ns, SdoSequence& sdo, FrameBatch& out) noexcept;
  DriveFault configure(int64_t now_ns, SdoSequence& sdo, FrameBatch& out) noexcept;
  void begin_set_up(SdoSequence& sdo) noexcept;
  void begin_configuring(SdoSequence& sdo) noexcept;
  void check_power(int64_t now_ns, SdoSequence& sdo, FrameBatch& out) noexcept;
  void start_nmt(int64_t now_ns, FrameBatch& out) noexcept;

  const MasterConfig& config_;
  int node_;
  std::vector<SdoStep> setup_steps_, power_off_steps_, release_steps_;
  DriveNames names_;
  Stage stage_ = Stage::kReset;
  int64_t stage_since_ns_ = 0;
  int64_t reset_ns_ = 0;                // when the communication was reset
  bool enters_preoperational_ = false;  // NMT pre-operational is to be sent
  bool may_monitor_master_ = false;     // its heartbeat consumer has been, or may have been, set up
  bool power_is_off_ = false, power_is_on_ = false;
  bool ours_ = false;  // see release
  int64_t last_nmt_start_ns_ = 0;
  NmtState nmt_ = NmtState::kBootUp;
  int64_t heartbeat_ns_ = 0;  // arrival of the last one
};

}  // namespace tendril::hal
