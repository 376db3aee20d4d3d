// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/bus/frame_batch.h"
#include "hal/canopen/canopen.h"
#include "hal/cia402/cia402.h"
#include "hal/cia402/simulated_cia402_motion.h"
#include "hal/cia402/simulated_cia402_spec.h"
#include "hal/cia402/simulated_object_dictionary.h"
#include "hal/cia402/simulated_pdos.h"
#include "hal/cia402/simulated_sdo_server.h"
#include "hal/sim/simulated_drive.h"

namespace tendril::hal {

/// One simulated servo drive: a CANopen slave with the CiA 402 profile. NMT, heartbeats, EMCY and the power
/// states are here; SimulatedSdoServer, SimulatedPdos and SimulatedCia402Motion are its parts.
///
/// It does what the master set up over SDO and nothing by assumption: PDO mapping and transmission types,
/// heartbeats both ways, interpolation period, following-error window, soft limits. Its axis moves as
/// SimulatedServo does; without "operation enabled" the position stays where it is. In torque mode there are
/// no soft limits. Positions are sent in whole counts. A quick stop, and bit 8 of the controlword, halt, make
/// it stand at once, with its power on. Not supported: segmented writes, block SDO, more than one pair of
/// PDOs, remote requests, SYNC counters, node guarding.
class SimulatedCia402Drive {
 public:
  /// Powers the drive on; its boot-up message comes with the first `advance`. Real-time: yes.
  explicit SimulatedCia402Drive(const SimulatedCia402Spec& spec) noexcept;

  /// Processes a frame at an instant and appends the answers; frames for other nodes are ignored.
  /// @param now_ns  never before an earlier call's
  /// Real-time: yes (bounded, no allocation).
  void receive(const Frame& frame, int64_t now_ns, FrameBatch& out) noexcept;

  /// Lets time pass up to `now_ns`: motion, heartbeats, time-outs.
  /// Real-time: yes (bounded, no allocation).
  void advance(int64_t now_ns, FrameBatch& out) noexcept;

  /// Position of the axis, counts from the zero of SimulatedCia402Spec, with its fraction; not the value of
  /// its encoder. Real-time: yes.
  double position() const noexcept { return motion_.position(); }

  /// State of the power drive system. Real-time: yes.
  DriveState state() const noexcept { return state_; }

  /// State of the power stage. Real-time: yes.
  PowerStage power_stage() const noexcept;

  /// State as a CANopen slave. Real-time: yes.
  NmtState nmt_state() const noexcept { return nmt_; }

  /// Makes the drive fail with that EMCY error code at the next `advance`. Real-time: yes.
  void inject_fault(uint32_t code) noexcept { injected_fault_ = static_cast<uint16_t>(code); }

  /// Jams its mechanics, or releases them. Real-time: yes.
  void set_jammed(bool jammed) noexcept { motion_.set_jammed(jammed); }

  /// See SimulatedServo. Real-time: yes.
  void set_load(double load) noexcept { motion_.set_load(load); }

  /// Makes it fail with the error of a hot power stage. Real-time: yes.
  void overheat() noexcept { inject_fault(kOverheated); }

 private:
  static constexpr uint16_t kOverheated = 0x4310;  // excess temperature of the drive [CiA 402]

  SimulatedCia402Motion::Input motion_input() const noexcept {
    return {objects_, state_ == DriveState::kEnabled};
  }
  void restore_settings() noexcept;
  void handle_nmt(NmtCommand command) noexcept;
  void reset() noexcept;
  void serve_sdo(const SdoRequest& request, FrameBatch& out) noexcept;
  void on_sync(FrameBatch& out) noexcept;
  void on_rpdo(const Frame& frame, FrameBatch& out) noexcept;
  void apply_rpdo(FrameBatch& out) noexcept;
  void apply_controlword(uint16_t word, FrameBatch& out) noexcept;
  void update_actual_values() noexcept;
  void send_heartbeat(int64_t now_ns, FrameBatch& out) noexcept;
  void monitor_master(int64_t now_ns, FrameBatch& out) noexcept;
  void fail(uint16_t code, FrameBatch& out) noexcept;
  void report(uint16_t code, FrameBatch& out) noexcept;
  void update_error_register() noexcept;

  int node_;
  bool left_enabled_;
  uint32_t error_window_;  // counts, at power-on
  uint32_t rated_torque_mNm_;
  SimulatedObjectDictionary objects_;
  SimulatedSdoServer sdo_server_;
  SimulatedPdos pdos_;
  SimulatedCia402Motion motion_;
  NmtState nmt_ = NmtState::kBootUp;
  DriveState state_ = DriveState::kNotReady;
  uint16_t controlword_ = 0;  // last one applied
  uint16_t injected_fault_ = 0;
  int64_t now_ns_ = 0;
  int64_t next_heartbeat_ns_ = 0;
  int64_t master_seen_ns_ = -1;  // -1: not monitored before its first heartbeat
};

}  // namespace tendril::hal
