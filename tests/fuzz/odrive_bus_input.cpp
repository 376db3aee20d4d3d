// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "hal/odrive/odrive.h"
#include "hal/odrive/odrive_protocol.h"
#include "hal/odrive/odrive_settings.h"
#include "tests/fuzz/bus_input.h"
#include "tests/fuzz/inputs.h"

namespace tendril::fuzz {
namespace {

/// Axes of either firmware, then axes on efforts.
std::vector<hal::MasterConfig> odrive_configs() {
  hal::MasterConfig config = two_axes(hal::odrive_protocol());
  config.heartbeat_ns = 100'000'000;
  config.heartbeat_timeout_ns = 250'000'000;
  for (hal::AxisConfig& axis : config.axes) {
    axis.scale.counts_per_turn = 1;
    hal::odrive_settings(axis).counts_from_power_on = false;
  }
  std::vector<hal::MasterConfig> configs(3, config);
  hal::odrive_settings(configs[1]).firmware = hal::OdriveFirmware::k0_5;
  for (hal::AxisConfig& axis : configs[2].axes) axis.set_point = hal::SetPoint::kEffort;
  return configs;
}

std::optional<bool> says_closed_loop(const hal::MasterConfig& config, const hal::AxisConfig& axis,
                                     const hal::Frame& frame) {
  const auto heartbeat =
      hal::decode_odrive_heartbeat(frame, axis.node, hal::odrive_settings(config).firmware);
  if (!heartbeat) return std::nullopt;
  return heartbeat->state == hal::kOdriveClosedLoop;
}

bool asks_for_closed_loop(const hal::MasterConfig&, const hal::AxisConfig& axis, const hal::Frame& frame) {
  return hal::decode_odrive_state(frame, axis.node) == uint32_t{hal::kOdriveClosedLoop};
}

bool holds_finite_floats(const hal::MasterConfig&, const hal::AxisConfig& axis, const hal::Frame& frame) {
  const auto input = hal::decode_odrive_input(frame, axis.node);
  const auto torque = hal::decode_odrive_torque(frame, axis.node);
  return (!input || std::isfinite(input->position)) && (!torque || std::isfinite(*torque));
}

}  // namespace

bool feed_odrive_bus(const std::string& bytes) {
  static const Language language{&hal::odrive_protocol(), odrive_configs, says_closed_loop,
                                 asks_for_closed_loop, holds_finite_floats};
  return feed_bus(language, bytes);
}

}  // namespace tendril::fuzz
