// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/bus/bus_budget.h"
#include "hal/canopen/sdo_sequence.h"
#include "hal/cia402/cia402_settings.h"

/// How CiA 402 drives are set up over CANopen. Real-time: no, except where a function says yes.
namespace tendril::hal {

/// A heartbeat time as objects 1016 and 1017 hold it, ms, rounded. Real-time: yes.
uint32_t heartbeat_ms(int64_t duration_ns) noexcept;

/// The COB-IDs in force. Real-time: yes.
uint32_t rpdo_cob_id(const AxisConfig& axis) noexcept;
uint32_t tpdo_cob_id(const AxisConfig& axis) noexcept;

/// The identifiers of the frames that a drive sends: EMCY, SDO answer, heartbeat, TPDO. Real-time: yes.
std::array<uint32_t, 4> received_cia402_ids(const AxisConfig& axis) noexcept;

/// The meaning of an object that is set up: " (the second object in RPDO 1)"; empty for other objects.
/// @param object  index << 8 | subindex
std::string describe_set_up_object(uint32_t object);

/// The entries that prepare a drive in NMT pre-operational: power off, heartbeats both ways, one RPDO (6040
/// and 607A, or 6071) and one TPDO (6041, 6064) at every SYNC, which are read only where they are to stay as
/// found, cyclic synchronous position mode, or torque mode, SYNC without a counter, interpolation period, and
/// the following-error window where it is configured. [CiA 301, objects 1016, 1017, 1400-1A00; CiA 402-2,
/// objects 6060, 6061, 6065, 60C2]
std::vector<SdoStep> setup_steps(const AxisConfig& axis, const MasterConfig& config);

/// The entries that prepare a drive without power for its homing procedure: it still monitors the master, the
/// configured settings, homing mode. [CiA 402-2, objects 6098, 6099, 609A]
std::vector<SdoStep> homing_steps(const AxisConfig& axis, const MasterConfig& config);

/// The limits of the position that the drive enforces, counts (object 607D).
struct SoftLimits {
  int32_t min = 0, max = 0;
};

/// The limits of an axis' displacement as its drive counts, with the margin of RangeMonitor where it follows
/// efforts; nothing where the drive gets none.
std::optional<SoftLimits> soft_limits(const AxisConfig& axis);

/// Limits that also include a position outside, plus a hundredth of their range: a drive that is enabled
/// beyond its soft limits jumps to the nearest one, or fails. Real-time: yes.
SoftLimits widened(SoftLimits limits, int32_t position) noexcept;

/// The entries that prepare a drive without power for following targets: it still monitors the master, its
/// cyclic synchronous mode, no offsets to the targets, and its soft limits, if any. [CiA 402-2, objects
/// 60B0-60B2]
std::vector<SdoStep> following_steps(const AxisConfig& axis, const MasterConfig& config);

/// Puts soft limits into such entries. Real-time: yes.
void set_soft_limits(std::span<SdoStep> steps, SoftLimits limits) noexcept;

/// The mode in which a drive follows the targets of the controller (6060). Real-time: yes.
int8_t following_mode(const AxisConfig& axis) noexcept;

/// The entry in which a drive shows its mode (6061). Some show it seconds after it was chosen, or only with
/// power.
std::vector<SdoStep> mode_steps(int8_t mode);

/// The entries that switch the power of a drive off, whatever it does with PDOs, and by which it says that it
/// is off.
std::vector<SdoStep> power_off_steps();

/// The entries at the end of a run: the drive no longer monitors the master.
std::vector<SdoStep> release_steps();

/// The frames of a running robot, for the bus budget: PDOs, SYNC, heartbeats; without the sensors'.
std::vector<PeriodicFrames> cia402_frames(const MasterConfig& config);

}  // namespace tendril::hal
