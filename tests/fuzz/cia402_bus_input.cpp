// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/little_endian.h"
#include "hal/cia402/cia402.h"
#include "hal/cia402/cia402_protocol.h"
#include "hal/cia402/cia402_settings.h"
#include "hal/cia402/cia402_setup.h"
#include "tests/fuzz/bus_input.h"
#include "tests/fuzz/inputs.h"

namespace tendril::fuzz {
namespace {

/// Absolute axes, then axes on efforts, axes that are homed, and axes that are mapped already.
std::vector<hal::MasterConfig> cia402_configs() {
  std::vector<hal::MasterConfig> configs(4, two_axes(hal::cia402_protocol()));
  for (hal::AxisConfig& axis : configs[1].axes) {
    axis.set_point = hal::SetPoint::kEffort;
    hal::cia402_settings(axis).rated_torque = 1;
  }
  for (hal::AxisConfig& axis : configs[2].axes) {
    hal::Cia402AxisSettings& settings = hal::cia402_settings(axis);
    settings.reference = hal::Reference::kHoming;
    settings.homing_given = true;
    settings.homing.method = 17;
    settings.homing.speed_search = 200;
    settings.homing.speed_zero = 20;
    settings.homing.acceleration = 1000;
  }
  configs[3].listen_ns = 100'000'000;
  for (hal::AxisConfig& axis : configs[3].axes) {
    hal::Cia402AxisSettings& settings = hal::cia402_settings(axis);
    settings.mapping = hal::Mapping::kAsFound;
    settings.referenced_bit = 15;
  }
  return configs;
}

std::optional<bool> says_enabled(const hal::MasterConfig&, const hal::AxisConfig& axis,
                                 const hal::Frame& frame) {
  const auto feedback = hal::decode_drive_feedback(hal::tpdo_cob_id(axis), frame);
  if (!feedback) return std::nullopt;
  return hal::decode_statusword(feedback->statusword) == hal::DriveState::kEnabled;
}

/// Homing needs power before any command.
bool asks_for_power(const hal::MasterConfig&, const hal::AxisConfig& axis, const hal::Frame& frame) {
  if (frame.id != hal::rpdo_cob_id(axis) || frame.length < 2) return false;
  const auto word = hal::get<uint16_t>(frame.data, 0);
  const bool homes = hal::cia402_settings(axis).reference == hal::Reference::kHoming;
  return !homes && (word & (hal::kEnableOperation | hal::kFaultReset)) == hal::kEnableOperation;
}

bool is_finite(const hal::MasterConfig&, const hal::AxisConfig&, const hal::Frame&) { return true; }

}  // namespace

bool feed_cia402_bus(const std::string& bytes) {
  static const Language language{&hal::cia402_protocol(), cia402_configs, says_enabled, asks_for_power,
                                 is_finite};
  return feed_bus(language, bytes);
}

}  // namespace tendril::fuzz
