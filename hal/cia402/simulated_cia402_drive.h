#pragma once

#include <cstdint>
#include <string_view>

#include "hal/bus/frame_batch.h"
#include "hal/canopen/canopen.h"
#include "hal/cia402/cia402.h"
#include "hal/cia402/simulated_object_dictionary.h"
#include "hal/sim/simulated_drive.h"
#include "hal/sim/simulated_servo.h"

namespace tendril::hal {

/// What a simulated drive is made of.
struct SimulatedCia402Spec {
  int node = 1;          // 1..127
  int pdo = 1;           // 1..4: which pair of PDOs it has
  uint32_t rpdo_id = 0;  // COB-IDs with which these are mapped and on at power-on; 0: they are not
  uint32_t tpdo_id = 0;
  double top_speed = 1e6;      // counts/s, > 0
  double position_counts = 0;  // where it stands at power-on, from the place that homing makes the zero
  bool incremental = false;    // its encoder counts from power-on until it has been homed
  int referenced_bit = -1;  // of the statusword, 0..15, that tells whether it has a reference; -1: none does
  ServoTuning tuning{};
  uint32_t error_window = 0xFFFF'FFFF;        // 6065 at power-on, counts; 0xFFFFFFFF: not watched
  uint32_t rpdo_target = kMapTargetPosition;  // the target in an RPDO that is mapped at power-on
  uint32_t rated_torque_mNm = 1000;           // 6076
  double torque_limit = 2;                    // > 0, in rated torques: SimulatedServo's force limit
};

/// One simulated servo drive: a CANopen slave with the CiA 402 profile, in cyclic synchronous position mode,
/// cyclic synchronous torque mode and homing mode.
///
/// Homing methods: 17 and 18, the limit switch at the negative and at the positive end, and 35 and 37, the
/// present position. Whichever the switch, it closes beyond SimulatedCia402Spec's zero, and is found again
/// from there.
///
/// It does what the master set up over SDO and nothing by assumption: PDO mapping and transmission types,
/// heartbeats both ways, interpolation period, following-error window, soft limits. Its axis moves as
/// SimulatedServo does: the target positions are interpolated over the interpolation period, their rate is
/// fed forward, and without "operation enabled" the position stays where it is; with target torques it
/// pushes, and knows no soft limits. Positions are told in whole counts. A quick stop, and bit 8 of the
/// controlword, halt, make it stand at once, with its power on. Not spoken: segmented writes, block SDO, more
/// than one pair of PDOs, remote requests, SYNC counters, node guarding.
class SimulatedCia402Drive {
 public:
  /// Powers the drive on; its boot-up message comes with the first `advance`. Real-time: yes.
  explicit SimulatedCia402Drive(const SimulatedCia402Spec& spec) noexcept;

  /// Takes in a frame at an instant and appends the answers; frames of others are ignored.
  /// @param now_ns  never before an earlier call's
  /// Real-time: yes (bounded, no allocation).
  void receive(const Frame& frame, int64_t now_ns, FrameBatch& out) noexcept;

  /// Lets time pass up to `now_ns`: motion, heartbeats, time-outs.
  /// Real-time: yes (bounded, no allocation).
  void advance(int64_t now_ns, FrameBatch& out) noexcept;

  /// Position of the axis, counts from SimulatedCia402Spec's zero, with its fraction, whatever its encoder
  /// says. Real-time: yes.
  double position() const noexcept { return servo_.position(); }

  /// State of the power drive system. Real-time: yes.
  DriveState state() const noexcept { return state_; }

  /// State of the power stage, whatever the protocol calls it. Real-time: yes.
  PowerStage power_stage() const noexcept;

  /// State as a CANopen slave. Real-time: yes.
  NmtState nmt_state() const noexcept { return nmt_; }

  /// Makes the drive fail with that EMCY error code at the next `advance`. Real-time: yes.
  void inject_fault(uint32_t code) noexcept { injected_fault_ = static_cast<uint16_t>(code); }

  /// Jams its mechanics, or lets them go. Real-time: yes.
  void set_jammed(bool jammed) noexcept { servo_.set_jammed(jammed); }

  /// As SimulatedServo. Real-time: yes.
  void set_load(double load) noexcept { servo_.set_load(load); }

  /// Makes it fail as a hot power stage would. Real-time: yes.
  void overheat() noexcept { inject_fault(kOverheated); }

 private:
  static constexpr uint16_t kOverheated = 0x4310;  // excess temperature of the drive [CiA 402]

  void obey_nmt(NmtCommand command) noexcept;
  void reset() noexcept;
  void serve_sdo(const SdoRequest& request, FrameBatch& out) noexcept;
  SdoAnswer write(const SdoRequest& request, FrameBatch& out) noexcept;
  SdoAnswer read(ObjectAddress object) noexcept;
  SdoAnswer next_segment(bool toggle) noexcept;
  static uint32_t refuse_value(SimulatedObjectDictionary::Slot slot, uint32_t value) noexcept;
  void set(SimulatedObjectDictionary::Slot slot, uint32_t value) noexcept;
  void on_rpdo(const Frame& frame, FrameBatch& out) noexcept;
  void on_sync(FrameBatch& out) noexcept;
  void apply_rpdo(FrameBatch& out) noexcept;
  void send_tpdo(bool only_if_changed, FrameBatch& out) noexcept;
  void tell_changes(FrameBatch& out) noexcept;
  void measure() noexcept;
  void apply_controlword(uint16_t word, FrameBatch& out) noexcept;
  void restore_settings() noexcept;
  void latch_target() noexcept;
  void move(int64_t now_ns) noexcept;
  void start_homing() noexcept;
  void home(int64_t now_ns) noexcept;
  void take_reference(double zero) noexcept;
  bool strays() noexcept;
  void fail(uint16_t code, FrameBatch& out) noexcept;
  void report(uint16_t code, FrameBatch& out) noexcept;
  void update_error_register() noexcept;
  void watch_master(int64_t now_ns, FrameBatch& out) noexcept;
  bool halted() const noexcept { return (controlword_ & kHalt) != 0; }
  bool interpolates() const noexcept;
  bool pushes() const noexcept;
  bool homes() const noexcept;
  bool searches() const noexcept;
  uint16_t statusword() const noexcept;
  int32_t actual_counts() const noexcept;
  int16_t actual_torque() const noexcept;

  int node_;
  uint32_t error_window_;  // counts, at power-on
  uint32_t rated_torque_mNm_;
  double torque_limit_;  // in rated torques
  SimulatedObjectDictionary objects_;
  NmtState nmt_ = NmtState::kBootUp;
  DriveState state_ = DriveState::kNotReady;
  int64_t now_ns_ = 0;
  bool started_ = false;  // now_ns_ has been set

  enum class Homing : uint8_t { kNone, kSearching, kLeavingSwitch, kAttained, kError };

  double zero_;                   // where its encoder reads 0, counts from SimulatedCia402Spec's zero
  SimulatedServo servo_;          // in counts from there
  bool limited_ = false;          // the target was beyond a soft limit
  bool strayed_ = false;          // the following-error window was left for longer than allowed
  int64_t beyond_since_ns_ = -1;  // out of that window; -1: it is not
  Homing homing_ = Homing::kNone;
  double homing_speed_ = 0;  // counts/s
  bool referenced_;
  uint16_t referenced_mask_;

  ObjectAddress upload_;          // that is read in segments
  std::string_view upload_left_;  // empty: none is
  bool upload_toggle_ = false;    // of the next segment

  Frame pending_rpdo_;  // waits for SYNC
  bool has_pending_rpdo_ = false;
  uint16_t controlword_ = 0;     // last one applied
  bool rpdo_too_short_ = false;  // the last one
  int syncs_since_tpdo_ = 0;
  Frame last_tpdo_;
  int64_t tpdo_ns_ = 0;  // when it was sent

  int64_t next_heartbeat_ns_ = 0;
  int64_t master_seen_ns_ = -1;  // -1: the master is not watched, for want of its first heartbeat
  uint16_t injected_fault_ = 0;
};

}  // namespace tendril::hal
