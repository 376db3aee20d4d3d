#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hal/drive/axis_scale.h"
#include "hal/sensor/sensor.h"

namespace tendril::hal {

/// The protocols that drives can speak; one protocol a bus, as their identifiers collide.
enum class Protocol : uint8_t {
  kCanopen,  // CiA 402 over CANopen, cyclic synchronous position or torque
  kOdrive    // ODrive CANSimple
};

/// Firmware families. They differ in the heartbeat's last bytes and in what the error bits mean.
enum class OdriveFirmware : uint8_t { k0_5, k0_6 };

/// What an axis is commanded.
enum class SetPoint : uint8_t {
  kDisplacement,  // where its actuator shall be
  kEffort         // what its actuator shall exert, as a torque of the drive
};

/// How an axis comes to know where it stands.
enum class Reference : uint8_t {
  kAbsolute,  // it has known since power-on, or from others
  kHoming     // by the drive's own homing procedure, at the start
};

/// A drive's homing procedure [CiA 402-2, homing mode]: what is not given stays as the drive has it.
struct HomingConfig {
  std::optional<int8_t> method;          // 6098
  std::optional<uint32_t> speed_search;  // 6099:1, for the switch, in the drive's own unit of speed
  std::optional<uint32_t> speed_zero;    // 6099:2, for the zero, likewise
  std::optional<uint32_t> acceleration;  // 609A, in the drive's own unit of acceleration
  int64_t timeout_ns = 60'000'000'000;   // for the whole procedure
};

/// Who sees to it that a drive's PDOs hold what is needed.
enum class Mapping : uint8_t {
  kConfigure,  // the master, at each start
  kAsFound     // others; the master reads them and refuses what differs
};

/// What is CANopen's alone of an axis.
struct CanopenAxis {
  int pdo = 1;           // which pair of PDOs to use, 1..4: objects 1400 + pdo - 1 and so on
  uint32_t rpdo_id = 0;  // 11-bit COB-IDs; 0: those of the predefined connection set
  uint32_t tpdo_id = 0;
  Mapping mapping = Mapping::kConfigure;
  Reference reference = Reference::kAbsolute;
  int referenced_bit = -1;  // of the statusword, 0..15: set while the drive has a reference; -1: it has none
  HomingConfig homing{};
  bool soft_limits = true;     // the drive is told the limits of the displacement (607D)
  double following_error = 0;  // m or m³: the drive's own window around its target (6065); 0: what it has
  double rated_torque = 0;     // Nm, > 0 with SetPoint::kEffort: what 1000 in 6071 is where a turn is counted
};

/// What is ODrive's alone of an axis; with both at 0 the axis keeps the limits it has.
struct OdriveAxisLimits {
  double velocity = 0;  // rev/s
  double current = 0;   // A
};

/// One axis as a master must know it.
struct AxisConfig {
  std::string name;                                                    // for people
  int node = 0;                                                        // as the protocol numbers them
  AxisScale scale{};                                                   // 1 count a turn with ODrive
  double displacement_min = -std::numeric_limits<double>::infinity();  // m or m³; infinite: no limit
  double displacement_max = std::numeric_limits<double>::infinity();
  SetPoint set_point = SetPoint::kDisplacement;
  CanopenAxis canopen{};
  OdriveAxisLimits odrive{};
};

/// What is CANopen's alone. Durations in ns.
struct CanopenConfig {
  int master_node = 127;
  int64_t sdo_timeout_ns = 100'000'000;  // of each attempt
  int sdo_attempts = 3;
  int64_t boot_timeout_ns = 1'000'000'000;  // without a boot-up message by then the drive is taken to be up
};

/// What is ODrive's alone. Durations in ns.
struct OdriveConfig {
  OdriveFirmware firmware = OdriveFirmware::k0_6;
  int64_t encoder_period_ns = 10'000'000;  // between encoder estimates, as the drives are set up
};

/// What a master must know, whatever the protocol. Durations in ns.
struct MasterConfig {
  Protocol protocol = Protocol::kCanopen;
  std::vector<AxisConfig> axes{};
  int64_t period_ns = 0;                       // of the control loop
  int64_t heartbeat_ns = 50'000'000;           // between heartbeats
  int64_t heartbeat_timeout_ns = 150'000'000;  // silence that counts as the loss of a node
  int64_t start_timeout_ns = 1'000'000'000;    // until a drive shows that it works, without power
  int64_t enable_timeout_ns = 3'000'000'000;   // from the wish to follow commands to the drive that does
  int64_t feedback_timeout_ns = 50'000'000;    // without positions
  std::vector<SensorConfig> sensors{};
  CanopenConfig canopen{};
  OdriveConfig odrive{};
};

/// Checks what every protocol asks for: number of axes, scales, period, time-outs, sensors.
/// @throws std::invalid_argument with a sentence that names the axis and what is expected
/// Real-time: no.
void check_common(const MasterConfig& config);

/// Says that a configuration is not sound. @throws std::invalid_argument "drives: WHAT"
[[noreturn]] void refuse_drives(const std::string& what);

/// "axis 'north' (node 3)". Real-time: no (allocates).
std::string to_text(const AxisConfig& axis);

/// "axis 2 'north' (node 3)". Real-time: no (allocates).
std::string name_of(const MasterConfig& config, int axis);

/// Who sends with which identifier: on CAN two nodes that send the same one destroy each other's frames.
/// Real-time: no (allocates).
class IdentifierClaims {
 public:
  /// @param id    see marked_id
  /// @param user  for the message, "axis 'north' (node 3)"
  /// @throws std::invalid_argument where the identifier has another user
  void claim(uint32_t id, const std::string& user);

  /// For each sensor its identifier. @throws std::invalid_argument as above
  void claim(const std::vector<SensorConfig>& sensors);

  /// Who uses an identifier; nullptr where it is free.
  const std::string* user(uint32_t id) const;

 private:
  std::map<uint32_t, std::string> users_;
};

}  // namespace tendril::hal
