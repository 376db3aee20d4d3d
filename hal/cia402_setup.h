#pragma once

#include <vector>

#include "hal/bus_budget.h"
#include "hal/master_config.h"
#include "hal/sdo_sequence.h"

/// How CiA 402 drives are set up over CANopen, and what that asks of a configuration. Real-time: no, for all
/// of it but the COB-IDs.
namespace tendril::hal {

/// The COB-IDs in force. Real-time: yes.
uint32_t rpdo_cob_id(const AxisConfig& axis) noexcept;
uint32_t tpdo_cob_id(const AxisConfig& axis) noexcept;

/// Checks ranges, and that no two senders share an identifier.
/// @throws std::invalid_argument with a sentence that names the axis and what is expected
void check_cia402(const MasterConfig& config);

/// The entries that prepare a drive in NMT pre-operational: heartbeats both ways, one RPDO (6040, 607A) and
/// one TPDO (6041, 6064) at every SYNC, cyclic synchronous position mode, interpolation period. [CiA 301,
/// objects 1016, 1017, 1400-1A00; CiA 402-2, objects 6060, 6061, 60C2]
std::vector<SdoStep> setup_steps(const AxisConfig& axis, const MasterConfig& config);

/// The entries that prepare a drive without power for its homing procedure: what is configured of it, homing
/// mode. [CiA 402-2, objects 6098, 6099, 609A]
std::vector<SdoStep> homing_steps(const AxisConfig& axis);

/// The entries that prepare a drive without power for following targets: cyclic synchronous position mode.
std::vector<SdoStep> following_steps();

/// The entries that let a drive go: it watches the master no more.
std::vector<SdoStep> release_steps();

/// The frames of a running robot, for the bus budget: PDOs, SYNC, heartbeats; without the tracker's.
std::vector<PeriodicFrames> cia402_frames(const MasterConfig& config);

}  // namespace tendril::hal
