// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <any>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "hal/bus/bus_budget.h"
#include "hal/drive/drives.h"
#include "hal/drive/frame_layout.h"
#include "hal/drive/master_config.h"
#include "hal/drive/settings.h"

namespace tendril::hal {

class SimulatedDrive;
struct SimulatedActuator;

/// The syntax by which a fault is injected into a simulated drive: "fault AXIS emcy CODE".
struct FaultInjection {
  std::string_view word;    // the protocol's word for its codes: "emcy"
  std::string_view effect;  // for people
  uint32_t largest_code = 0;
};

/// The interface of a drive protocol. Each protocol is one object of this type in a folder of its own;
/// docs/drives.md says how to add one. Real-time: no, for all functions (they allocate); the objects that
/// make_master and make_simulated_drive return say it themselves.
class DriveProtocol {
 public:
  virtual ~DriveProtocol() = default;

  /// What `bus.protocol` calls it in a robot file.
  virtual std::string_view name() const = 0;

  /// Reads its own keys of the section `bus`. The common ones are read afterwards, so that defaults which
  /// differ from those of MasterConfig can be set here.
  virtual void read_bus(Settings& section, MasterConfig& config) const = 0;

  /// Reads its own keys of the section `drive` of an actuator, among them the node; the common ones have been
  /// read.
  /// @param displacement  quantity of the actuator's displacement: a length or a volume
  virtual void read_drive(Settings& section, Dimension displacement, AxisConfig& axis) const = 0;

  /// Reads its own keys of the section `plant.drives`.
  /// @param protocol_settings  for SimulatedActuator::protocol_settings
  virtual void read_simulation(Settings& section, std::any& protocol_settings) const = 0;

  /// Checks a whole configuration: ranges, nodes, and that no two senders share an identifier.
  /// @throws SettingError; std::invalid_argument with a sentence where no single setting is wrong
  virtual void check(const MasterConfig& config) const = 0;

  /// What a person must know at each start with a sound configuration, and what is worth a check; one
  /// sentence each.
  virtual std::vector<std::string> warnings(const MasterConfig& /*config*/) const { return {}; }
  virtual std::vector<std::string> advice(const MasterConfig& /*config*/) const { return {}; }

  /// The resolution of commanded efforts of an axis that follows efforts, N or Pa; 0: none that matters.
  virtual double effort_step(const AxisConfig& /*axis*/) const { return 0; }

  /// How its frames travel.
  virtual Wire wire() const { return Wire::kCan; }

  /// The frames of a running robot without those of its sensors, for the bus budget.
  virtual std::vector<PeriodicFrames> periodic_frames(const MasterConfig& config) const = 0;

  /// The layouts of frames that belong to no drive, and of those of one drive, for a DBC.
  virtual std::vector<FrameLayout> bus_layouts(const MasterConfig& /*config*/) const { return {}; }
  virtual std::vector<FrameLayout> drive_layouts(const MasterConfig& config, int axis,
                                                 const DisplacementUnit& unit) const = 0;

  /// The controller's side.
  /// @throws as `check`
  virtual std::unique_ptr<DriveMaster> make_master(const MasterConfig& config) const = 0;

  /// The drive's side, for one axis of a simulated robot.
  /// @param config  one that passes `check`
  virtual std::unique_ptr<SimulatedDrive> make_simulated_drive(const MasterConfig& config, int axis,
                                                               const SimulatedActuator& actuator) const = 0;

  virtual FaultInjection fault_injection() const = 0;

  /// The electronic data sheet of the simulated drives; empty where the protocol has none.
  virtual std::string data_sheet() const { return ""; }

 protected:
  DriveProtocol() = default;
  DriveProtocol(const DriveProtocol&) = delete;
  DriveProtocol& operator=(const DriveProtocol&) = delete;
};

/// The controller's side of the configured protocol.
/// @throws as DriveProtocol::check
/// Real-time: no (allocates).
std::unique_ptr<DriveMaster> make_master(const MasterConfig& config);

/// The frames of a running robot, those of its sensors included. Real-time: no (allocates).
std::vector<PeriodicFrames> periodic_frames(const MasterConfig& config);

/// The frames of drives, controller and sensors, in the order of their owners: those of the bus, then axis by
/// axis. Positions are in displacements, not in counts, torques in Nm.
/// @param config  one that passes DriveProtocol::check
/// @param units   one an axis
/// Real-time: no (allocates).
std::vector<FrameLayout> frame_layouts(const MasterConfig& config,
                                       const std::vector<DisplacementUnit>& units);

}  // namespace tendril::hal
