// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/cia402_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "hal/canopen/canopen.h"
#include "hal/cia402/cia402.h"
#include "hal/cia402/cia402_settings.h"
#include "hal/cia402/cia402_setup.h"
#include "hal/drive/formatted.h"

namespace tendril::hal {
namespace {

constexpr double kLargestTorque = 32.767;  // rated ones, object 6071, i16 in thousandths

/// With efforts the rated torque must be given, and the largest torque must fit into object 6071.
void check_torques(const MasterConfig& config, int i) {
  const AxisConfig& axis = config.axes[i];
  const double rated = cia402_settings(axis).rated_torque;
  if (axis.set_point != SetPoint::kEffort) return;
  if (!(rated > 0))
    refuse_drive(config, i, "rated_torque",
                 "the torque that the drive calls 1000, as drive.setpoint is effort");
  const double torque = std::abs(axis.scale.to_torque(axis.largest_effort));
  if (torque > kLargestTorque * rated)
    refuse_drive(
        config, i, "rated_torque",
        formatted("at least %.4g Nm, as the largest effort is a torque of %.4g Nm and object 6071 holds "
                  "32.767 times the rated one",
                  torque / kLargestTorque, torque));
}

/// Homing settings need reference: homing. A method that takes the present position as zero needs a bit that
/// says whether it has been done, so that a start does not move the zero.
void check_reference(const MasterConfig& config, int i) {
  const Cia402AxisSettings& settings = cia402_settings(config.axes[i]);
  if (settings.referenced_bit < -1 || settings.referenced_bit > 15)
    refuse_drive(config, i, "referenced_bit", "a bit of the statusword, 0 to 15");
  if (settings.reference != Reference::kHoming) {
    if (settings.homing_given) refuse_drive(config, i, "reference", "homing, as there is a section for it");
    return;
  }
  const HomingConfig& homing = settings.homing;
  if (homing.timeout_ns <= 0) refuse_drive(config, i, "homing.timeout", "a time above 0");
  if (homing.method && homes_in_place(*homing.method) && settings.referenced_bit < 0)
    refuse_drive(
        config, i, "referenced_bit",
        formatted("the statusword bit that tells whether it has been done, as homing method %d takes "
                  "wherever the axis stands at a start for the zero",
                  static_cast<int>(*homing.method)));
}

/// The range of displacements must fit the 32 bits of a position, and be many counts.
void check_counts(const MasterConfig& config, int i) {
  constexpr double kFewest = 100, kLargest = INT32_MAX;
  const AxisConfig& axis = config.axes[i];
  if (!std::isfinite(axis.displacement_min) || !std::isfinite(axis.displacement_max)) return;
  const double least = axis.scale.to_position(axis.displacement_min),
               greatest = axis.scale.to_position(axis.displacement_max);
  if (std::max(std::abs(least), std::abs(greatest)) > kLargest)
    refuse_drive(
        config, i, "counts_per_turn",
        formatted("positions that 32 bits hold; its displacements are %.4g to %.4g counts", least, greatest));
  const double counts = std::abs(greatest - least);
  if (axis.displacement_max > axis.displacement_min && counts < kFewest)
    refuse_drive(
        config, i, "counts_per_turn",
        formatted("at least %g counts in the range of displacements, which has %.3g", kFewest, counts));
}

void check_axis(const MasterConfig& config, int i) {
  const AxisConfig& axis = config.axes[i];
  if (axis.node < 1 || axis.node > 127) refuse_drive(config, i, "node", "a node id from 1 to 127");
  if (cia402_settings(axis).pdo < 1 || cia402_settings(axis).pdo > 4)
    refuse_drive(config, i, "pdo", "a PDO from 1 to 4");
  if (rpdo_cob_id(axis) > 0x7FF) refuse_drive(config, i, "rpdo_id", "a COB-ID of 11 bits");
  if (tpdo_cob_id(axis) > 0x7FF) refuse_drive(config, i, "tpdo_id", "a COB-ID of 11 bits");
  check_counts(config, i);
  check_reference(config, i);
  check_torques(config, i);
}

/// The identifiers that CiA 301 gives a node [predefined connection set].
constexpr struct {
  uint32_t base;
  const char* name;
} kPredefined[] = {{0x080, "the emergency message"},
                   {0x180, "TPDO 1"},
                   {0x200, "RPDO 1"},
                   {0x280, "TPDO 2"},
                   {0x300, "RPDO 2"},
                   {0x380, "TPDO 3"},
                   {0x400, "RPDO 3"},
                   {0x480, "TPDO 4"},
                   {0x500, "RPDO 4"},
                   {0x580, "the SDO answer"},
                   {0x600, "the SDO request"},
                   {0x700, "the heartbeat"}};

void check_identifiers(const MasterConfig& config) {
  IdentifierClaims claims;
  claims.claim(kNmtId, "the NMT command");
  claims.claim(kSyncId, "SYNC");
  const int master_node = cia402_settings(config).master_node;
  claims.claim(kHeartbeatBase + master_node, "the master's heartbeat");
  for (const AxisConfig& axis : config.axes) {
    for (const uint32_t base : {kEmergencyBase, kSdoAnswerBase, kSdoRequestBase, kHeartbeatBase})
      claims.claim(base + axis.node, label(axis));
    claims.claim(rpdo_cob_id(axis), label(axis));
    claims.claim(tpdo_cob_id(axis), label(axis));
  }
  // No sensor may use an identifier that CiA 301 gives a node, even if the node does not use it.
  for (const AxisConfig& axis : config.axes)
    for (const uint32_t id : {rpdo_cob_id(axis), tpdo_cob_id(axis)})
      claims.reserve(id, "that of a PDO of the drive of '" + axis.name + "'");
  const auto name_node = [&claims](int node) {
    for (const auto& [base, name] : kPredefined)
      claims.reserve(base + node, std::string(name) + " of node " + std::to_string(node));
  };
  for (const AxisConfig& axis : config.axes) name_node(axis.node);
  name_node(master_node);
  claims.claim_sensors(config);
}

}  // namespace

void check_cia402(const MasterConfig& config) {
  const Cia402BusSettings& bus = cia402_settings(config);
  if (bus.master_node < 1 || bus.master_node > 127) refuse_bus("master_node", "a node id from 1 to 127");
  check_common(config, config.period_ns, bus.master_node);
  if (heartbeat_ms(config.heartbeat_ns) < 1) refuse_bus("heartbeat", "at least 1 ms");
  if (heartbeat_ms(config.heartbeat_timeout_ns) > 0xFFFF) refuse_bus("heartbeat_timeout", "at most 65.535 s");
  if (bus.sdo_attempts < 1) throw std::invalid_argument("drives: there must be at least one SDO attempt");
  for (int i = 0; i < static_cast<int>(config.axes.size()); ++i) check_axis(config, i);
  check_identifiers(config);
}

}  // namespace tendril::hal
