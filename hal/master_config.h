#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/bus_budget.h"
#include "hal/cia402.h"
#include "hal/sdo_sequence.h"

namespace tendril::hal {

/// One axis as the CiA 402 master must know it.
struct AxisConfig {
  std::string name;  // for people
  int node = 0;      // CANopen node, 1..127
  AxisScale scale{};
  int pdo = 1;           // which pair of PDOs to use, 1..4: objects 1400 + pdo - 1 and so on
  uint32_t rpdo_id = 0;  // 11-bit COB-IDs; 0: those of the predefined connection set
  uint32_t tpdo_id = 0;

  /// The COB-ID in force. Real-time: yes.
  uint32_t rpdo_cob_id() const noexcept { return rpdo_id != 0 ? rpdo_id : 0x100 * (pdo + 1) + node; }
  uint32_t tpdo_cob_id() const noexcept { return tpdo_id != 0 ? tpdo_id : 0x100 * pdo + 0x80 + node; }
};

/// What the CiA 402 master must know. Durations in ns.
struct MasterConfig {
  std::vector<AxisConfig> axes{};
  int64_t period_ns = 0;  // of SYNC and of the control loop
  int master_node = 127;
  int64_t heartbeat_ns = 50'000'000;           // between heartbeats, both ways; whole ms on the bus
  int64_t heartbeat_timeout_ns = 150'000'000;  // both ways
  int64_t sdo_timeout_ns = 100'000'000;        // of each attempt
  int sdo_attempts = 3;
  int64_t boot_timeout_ns = 1'000'000'000;    // without a boot-up message by then the drive is taken to be up
  int64_t start_timeout_ns = 1'000'000'000;   // from NMT start to a heartbeat that says operational
  int64_t enable_timeout_ns = 3'000'000'000;  // from the wish to "operation enabled"
  int64_t feedback_timeout_ns = 50'000'000;   // without positions
  uint32_t tracker_id = 0;                    // 11-bit identifier of the tracker's frames; 0: there is none
  int64_t tracker_timeout_ns = 100'000'000;   // an older sighting is not fresh
  double tracker_rate_hz = 100;               // for the bus budget
};

/// Checks ranges, and that no two senders share an identifier.
/// @throws std::invalid_argument with a sentence that names the axis and what is expected
/// Real-time: no.
void check(const MasterConfig& config);

/// The entries that prepare a drive in NMT pre-operational: heartbeats both ways, one RPDO (6040, 607A) and
/// one TPDO (6041, 6064) at every SYNC, cyclic synchronous position mode, interpolation period. [CiA 301,
/// objects 1016, 1017, 1400-1A00; CiA 402-2, objects 6060, 6061, 60C2] Real-time: no (allocates).
std::vector<SdoStep> setup_steps(const AxisConfig& axis, const MasterConfig& config);

/// The entries that let a drive go: it watches the master no more.
/// Real-time: no (allocates).
std::vector<SdoStep> release_steps();

/// The frames of a running robot, for the bus budget: PDOs, SYNC, heartbeats, tracker.
/// Real-time: no (allocates).
std::vector<PeriodicFrames> periodic_frames(const MasterConfig& config);

}  // namespace tendril::hal
