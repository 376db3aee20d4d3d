// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <any>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "hal/drive/axis_scale.h"
#include "hal/sensor/sensor.h"

namespace tendril::hal {

class DriveProtocol;

/// The quantity that is commanded to an axis.
enum class SetPoint : uint8_t {
  kDisplacement,  // the displacement of its actuator
  kEffort         // the effort of its actuator, as a torque of the drive
};

/// The configuration of one axis.
struct AxisConfig {
  std::string name;                                                    // for people
  int node = 0;                                                        // as the protocol numbers them
  AxisScale scale{};                                                   // 1 count a turn with ODrive
  double displacement_min = -std::numeric_limits<double>::infinity();  // m or m³; infinite: no limit
  double displacement_max = std::numeric_limits<double>::infinity();
  double top_rate = 0;         // m/s or m³/s, the fastest that is commanded; 0: not known
  double following_error = 0;  // m or m³, > 0: see following_error_limit; 0: the default
  bool moves_volume = false;   // displacements are volumes, m³
  SetPoint set_point = SetPoint::kDisplacement;
  double largest_effort = 0;     // N or Pa, magnitude of the largest commanded effort; 0: not known
  std::any protocol_settings{};  // settings of its protocol, see settings_as
};

/// The configuration of a master, for all protocols. Durations in ns.
struct MasterConfig {
  const DriveProtocol* protocol = nullptr;  // of all drives on the bus
  std::vector<AxisConfig> axes{};
  int64_t period_ns = 0;              // of the control loop
  int64_t listen_ns = 0;              // for another controller, before the first frame; 0: not at all
  int64_t heartbeat_ns = 50'000'000;  // between heartbeats
  int64_t heartbeat_timeout_ns = 150'000'000;  // without a heartbeat, until a node counts as lost
  int64_t start_timeout_ns = 5'000'000'000;    // until a drive must have booted, and be running without power
  int64_t enable_timeout_ns = 15'000'000'000;  // from the begin of enabling until a drive is enabled
  int64_t disable_timeout_ns = 1'000'000'000;  // from the begin of disabling until a run ends all the same
  int64_t feedback_timeout_ns = 50'000'000;    // without a position
  std::vector<SensorConfig> sensors{};
  std::any protocol_settings{};  // settings of the protocol, see settings_as
};

/// A setting that is not sound; what() reads "drives: axis 'north' (node 3): KEY: expected ...".
struct SettingError : std::invalid_argument {
  enum class Section : uint8_t { kBus, kDrive, kSensor };

  /// @param place  the section, for what()
  SettingError(Section of, int number, const std::string& place, std::string name, std::string wanted)
      : std::invalid_argument("drives: " + place + name + ": expected " + wanted),
        section(of),
        index(number),
        key(std::move(name)),
        expected(std::move(wanted)) {}

  Section section;
  int index;  // of the drive or sensor
  std::string key;
  std::string expected;  // what the key should hold, as in Settings::fail
};

/// Real-time: no, for all three (they throw a SettingError).
[[noreturn]] void refuse_bus(const std::string& key, const std::string& expected);
[[noreturn]] void refuse_drive(const MasterConfig& config, int axis, const std::string& key,
                               const std::string& expected);
[[noreturn]] void refuse_sensor(const MasterConfig& config, int sensor, const std::string& key,
                                const std::string& expected);

/// Checks what every protocol requires: number of axes, scales, ranges, nodes, period, time-outs, sensors.
/// @param feedback_period_ns  between two positions of a drive
/// @param node_of_master      no drive may have it; -1: the controller has no node
/// @throws SettingError; std::invalid_argument with a sentence where no single setting is wrong
/// Real-time: no.
void check_common(const MasterConfig& config, int64_t feedback_period_ns, int node_of_master = -1);

/// "axis 'north' (node 3)". Real-time: no (allocates).
std::string label(const AxisConfig& axis);

/// "3.25 mm", or for a volume "3.25 ml". @param displacement  m or m³. Real-time: no (allocates).
std::string displacement_text(const AxisConfig& axis, double displacement);

/// "axis 2 'north' (node 3)". Real-time: no (allocates).
std::string label(const MasterConfig& config, int axis);

/// Which node sends with which identifier. On CAN two nodes must not send with the same one: their frames
/// collide.
/// Real-time: no (allocates).
class IdentifierClaims {
 public:
  /// @param id    see marked_id
  /// @param user  for the message, "axis 'north' (node 3)"
  /// @throws std::invalid_argument where the identifier has another user
  void claim(uint32_t id, const std::string& user);

  /// Reserves an identifier that is free; messages about sensors then name its user.
  void reserve(uint32_t id, const std::string& user) { users_[id] = user; }

  /// Claims the identifier of each sensor, after all others.
  /// @throws SettingError where it has another user
  void claim_sensors(const MasterConfig& config);

 private:
  std::map<uint32_t, std::string> users_;
};

/// The settings of a protocol, of type T, in the member of that name of AxisConfig, MasterConfig or
/// SimulatedActuator; defaults where it holds none.
/// Real-time: no (may allocate).
template <class T>
const T& settings_as(const std::any& protocol_settings) {
  static const T kDefaults{};
  const T* settings = std::any_cast<T>(&protocol_settings);
  return settings ? *settings : kDefaults;
}
template <class T>
T& settings_as(std::any& protocol_settings) {
  if (!std::any_cast<T>(&protocol_settings)) protocol_settings.emplace<T>();
  return *std::any_cast<T>(&protocol_settings);
}

/// Finds the settings of one protocol within a configuration: those of an axis and those of the bus. Defaults
/// where there are none. Real-time: no (the first call on a configuration that may be changed allocates).
template <class OfAxis, class OfBus>
struct SettingsOf {
  const OfAxis& operator()(const AxisConfig& axis) const {
    return settings_as<OfAxis>(axis.protocol_settings);
  }
  OfAxis& operator()(AxisConfig& axis) const { return settings_as<OfAxis>(axis.protocol_settings); }
  const OfBus& operator()(const MasterConfig& config) const {
    return settings_as<OfBus>(config.protocol_settings);
  }
  OfBus& operator()(MasterConfig& config) const { return settings_as<OfBus>(config.protocol_settings); }
};

}  // namespace tendril::hal
