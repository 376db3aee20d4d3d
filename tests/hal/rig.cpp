// SPDX-License-Identifier: Apache-2.0
#include "tests/hal/rig.h"

#include "hal/cia402/cia402_protocol.h"
#include "hal/cia402/cia402_setup.h"
#include "hal/odrive/odrive_protocol.h"

namespace tendril::hal::test {
namespace {

constexpr double kFriction = 0.2;  // a test that pulls at drives tells them so once a cycle

}  // namespace

MasterConfig config_of(int axes) {
  MasterConfig config;
  config.protocol = &cia402_protocol();
  config.period_ns = kPeriod_ns;
  config.start_timeout_ns = 1'000'000'000;
  config.enable_timeout_ns = 3'000'000'000;
  for (int i = 0; i < axes; ++i)
    config.axes.push_back(
        {.name = "cable " + std::to_string(i),
         .node = i + 1,
         .scale = {.counts_per_turn = 65536, .displacement_per_turn = 0.0628, .reversed = i % 2 == 1}});
  return config;
}

MasterConfig odrive_config_of(int axes, OdriveFirmware firmware) {
  MasterConfig config = config_of(axes);
  config.protocol = &odrive_protocol();
  config.heartbeat_ns = 100'000'000;
  config.heartbeat_timeout_ns = 250'000'000;
  odrive_settings(config).firmware = firmware;
  for (AxisConfig& axis : config.axes) {
    --axis.node;
    axis.scale.counts_per_turn = 1;
    odrive_settings(axis).counts_from_power_on = false;
  }
  return config;
}

MasterConfig on_efforts(MasterConfig config, int count, double range) {
  for (AxisConfig& axis : config.axes) {
    if (count-- > 0) {
      axis.set_point = SetPoint::kEffort;
      if (config.protocol == &cia402_protocol()) cia402_settings(axis).rated_torque = 1;
    }
    axis.displacement_min = -(axis.displacement_max = range);
  }
  return config;
}

SensorConfig camera(uint32_t id) {
  const auto coordinate = [](const char* name, int start) {
    return Signal{
        .name = name, .start = start, .length = 16, .type = SignalType::kSigned, .scale = 10e-6, .unit = "m"};
  };
  return {.name = "camera",
          .id = id,
          .signals = {coordinate("tip_x", 0), coordinate("tip_y", 16), coordinate("tip_z", 32)},
          .age = Signal{.name = "age", .start = 48, .length = 16, .scale = 10e-6, .unit = "s"}};
}

void add_drives(const MasterConfig& config, std::vector<SimulatedCia402Drive>& drives) {
  for (const AxisConfig& axis : config.axes)
    drives.emplace_back(SimulatedCia402Spec{
        .node = axis.node,
        .pdo = cia402_settings(axis).pdo,
        .rpdo_id = cia402_settings(axis).mapping == Mapping::kAsFound ? rpdo_cob_id(axis) : 0,
        .tpdo_id = cia402_settings(axis).mapping == Mapping::kAsFound ? tpdo_cob_id(axis) : 0,
        .position_counts = 1000.0 * axis.node,
        .incremental = cia402_settings(axis).reference == Reference::kHoming,
        .referenced_bit = cia402_settings(axis).referenced_bit,
        .tuning = {.friction = kFriction},
        .rpdo_target = axis.set_point == SetPoint::kEffort ? kMapTargetTorque : kMapTargetPosition});
}

void add_drives(const MasterConfig& config, std::vector<SimulatedOdriveDrive>& drives) {
  for (const AxisConfig& axis : config.axes)
    drives.emplace_back(SimulatedOdriveSpec{.node = axis.node,
                                            .firmware = odrive_settings(config).firmware,
                                            .position = 0.25 * (axis.node + 1),
                                            .heartbeat_ns = config.heartbeat_ns,
                                            .watchdog_ns = config.heartbeat_timeout_ns});
}

}  // namespace tendril::hal::test
