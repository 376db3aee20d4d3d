// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/bus/bus.h"
#include "hal/bus/frame_batch.h"
#include "hal/bus/wire.h"
#include "hal/sensor/sensor.h"

namespace tendril::hal {

/// Axes of the largest robot; every per-axis array has this size.
inline constexpr int kMaxAxes = TENDRIL_MAX_ACTUATORS;

/// What can go wrong with the drives and their bus. In brackets the meaning of DriveFault::code with CiA 402
/// and, after the semicolon, with ODrive, where OdriveAxis packs state and result.
enum class FaultKind : uint8_t {
  kNone,
  kConfiguration,    // a drive refused a setting or did not answer [SDO abort code; not used]
  kUnexpectedValue,  // an object of a drive has another value than it must [that value; not used]
  kStartTimeout,     // a drive did not become operational [its NMT state; 1 once its heartbeat was heard]
  kEnableTimeout,    // a drive did not reach "operation enabled" [statusword; state and result]
  kDriveFault,       // a drive reports a fault [EMCY error code, 0 while unknown; error bits]
  kDriveDisabled,    // a drive left "operation enabled" by itself [statusword; state and result]
  kDriveRestarted,   // a drive left NMT operational or rebooted [its NMT state; not used]
  kOutOfRange,       // an axis that follows efforts left its range [0.1 % of it, signed; likewise]
  kNotFollowing,     // an enabled axis does not follow its command [statusword where it says so; not used]
  kFeedbackJumped,   // the position of an enabled axis changed faster than a motor can [not used]
  kPositionJumped,   // the position of a drive changed at enabling [not used; 0.001 rev, signed]
  kNotReferenced,    // a drive has no reference, or has lost it [statusword; not used]
  kHomingFailed,     // a drive's homing procedure ended in an error [statusword; not used]
  kHomingTimeout,    // it did not end in time [statusword; not used]
  kHeartbeatLost,    // no heartbeat of a drive [0]
  kFeedbackLost,     // heartbeats of a drive, but no positions [0]
  kOtherMaster,      // another controller commands the drives [identifier of its frames; likewise]
  kBusStalled,       // the bus takes no more frames [0]
  kBusPassive,       // the bus is error-passive [0]
  kBusOff,           // the controller is bus-off [0]
  kBusDown           // the interface is down, or the host of a local bus is gone [0]
};

/// The kind in a few words: "heartbeat lost". Real-time: yes.
const char* name(FaultKind kind) noexcept;

/// A latched fault. The first one is kept: later ones are mostly its consequence.
struct DriveFault {
  FaultKind kind = FaultKind::kNone;
  int axis = -1;           // index of the axis; -1 where the bus as a whole is meant
  uint32_t code = 0;       // see FaultKind
  uint32_t object = 0;     // kConfiguration, kUnexpectedValue with CiA 402: object index << 8 | subindex
  uint32_t expected = 0;   // kUnexpectedValue: the value that it must have
  uint16_t emergency = 0;  // CiA 402: code of an EMCY that came before and is not taken back; 0: none
  double wanted = 0;       // m or m³; kNotFollowing: commanded, kFeedbackJumped: measured before
  double measured = 0;     // m or m³; kNotFollowing, kFeedbackJumped
};

/// A fault of kind kOutOfRange in words, without the name of the axis. Real-time: no (allocates).
std::string describe_out_of_range(const DriveFault& fault);

/// A fault of kind kOtherMaster in words. Real-time: no (allocates).
std::string describe_other_master(const DriveFault& fault);

/// What is known of the power stage of a drive.
enum class DrivePower : uint8_t {
  kOff,     // the drive has said so, or was never enabled
  kOn,      // the drive has not said that it is off
  kUnknown  // the drive is out of reach
};

/// "off", "on", "unknown". Real-time: yes.
const char* name(DrivePower power) noexcept;

/// The state of drives and sensors at one instant.
struct Measurement {
  int64_t stamp_ns = 0;  // instant of `measure`
  int axes = 0;
  std::array<double, kMaxAxes> displacement{};            // m or m³, the last that is known
  std::array<int64_t, kMaxAxes> displacement_stamp_ns{};  // arrival of each; 0: none yet
  // Every axis has its reference, and its position is younger than the feedback timeout.
  bool all_known = false;
  bool all_enabled = false;   // every drive is in "operation enabled": commanded positions are followed
  bool all_disabled = false;  // every drive has said that its power stage is off, or was never enabled
  std::array<DrivePower, kMaxAxes> power{};
  // Command::finish is done: no drive that has said that its power is off monitors the controller any more.
  // The power of the others is kOn or kUnknown. A master may also never get so far; who waits needs a limit.
  bool finished = false;
  DriveFault fault;  // latched until Command::reset
  SensorReadings sensors;
};

/// What the drives shall do.
struct Command {
  bool enable = false;  // bring all drives to "operation enabled", or take them out of it
  bool reset = false;   // clear the latched fault and start the axes that had one afresh
  bool finish = false;  // with `enable` false: once all are disabled, end communication with the drives
  int axes = 0;
  std::array<double, kMaxAxes> displacement{};  // m or m³; used once all drives are enabled
  std::array<double, kMaxAxes>
      effort{};  // N or Pa; for axes that follow efforts, as soon as they are enabled
};

/// The share of one axis in a Command.
struct AxisTarget {
  double displacement = 0, effort = 0;
};

/// Frames that a master sends in a cycle while the drives follow, at most: a set-point an axis, heartbeat and
/// SYNC. In no cycle it sends more than twice as many. Real-time: yes.
constexpr int frames_in_cycle(int axes) noexcept { return axes + 2; }

/// Cycles whose frames may wait for the bus: the last ones of a cycle may still be there when the next one
/// begins.
inline constexpr int kWaitingCycles = 2;

/// The controller's side of a drive protocol, for all axes: a state machine. No function waits.
///
/// Once per control period: `receive` for every frame of the bus, then `measure`, then `command`, and its
/// frames go out in their order. Starting the drives needs no calls of its own: it happens in these cycles,
/// and `all_known`, `all_enabled` and `fault` tell how far it is.
///
/// A drive that becomes enabled holds the position it has until all are enabled; from the cycle in which
/// `measure` says all_enabled on, positions are followed as they are commanded, so that cycle's must be the
/// measured ones. An axis that follows efforts exerts the one that is commanded as soon as it is enabled, and
/// any that is found outside its range then is in fault. After a fault the sound axes go on following their
/// commands (the controller ramps them to a stop), the faulty one is taken out of operation until `reset`.
class DriveMaster {
 public:
  virtual ~DriveMaster() = default;

  /// The identifiers, see marked_id, of all frames that `receive` uses.
  /// Real-time: no (allocates).
  virtual std::vector<uint32_t> identifiers() const = 0;

  /// How the frames travel, for the load of the bus. Real-time: yes.
  virtual Wire wire() const noexcept { return Wire::kCan; }

  /// Processes one frame of the bus; frames for other nodes are ignored.
  /// @param arrival_ns  when it arrived, which may be well before it was read
  /// Real-time: yes (bounded, no allocation).
  virtual void receive(const Frame& frame, int64_t arrival_ns) noexcept = 0;

  /// Checks time-outs and the state of the bus.
  /// @param health  of the bus the frames go over
  /// @return a measurement that is valid until the next call
  /// Real-time: yes (bounded, no allocation).
  virtual const Measurement& measure(BusHealth health, int64_t now_ns) noexcept = 0;

  /// Appends the frames of this cycle to `out`.
  /// @param command  a displacement or effort that is not finite leaves its axis at its last target
  /// Real-time: yes (bounded, no allocation).
  virtual void command(const Command& command, int64_t now_ns, FrameBatch& out) noexcept = 0;

  /// A fault in one sentence that names axis, node and cause, for the log.
  /// Real-time: no (allocates).
  virtual std::string describe(const DriveFault& fault) const = 0;

  /// Which drive has answered for an axis, in one sentence for the log.
  /// @return  empty until it has answered, always where the protocol has no such message; then it never
  ///          changes
  /// Real-time: no (allocates). May be called while another thread runs the cycles.
  virtual std::string identity(int /*axis*/) const { return ""; }

 protected:
  DriveMaster() = default;
  DriveMaster(const DriveMaster&) = delete;
  DriveMaster& operator=(const DriveMaster&) = delete;
};

}  // namespace tendril::hal
