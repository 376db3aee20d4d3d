// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "app/config/config.h"
#include "hal/drive/drives.h"

namespace tendril::app {

/// A robot of one cable and a tip that moves in x and z, without a path.
inline Config small_robot() {
  Config config;
  config.robot = "finger";
  config.effectors = {{"tip", {}, {true, false, true}, {}, {1, 1}}};
  config.actuators.resize(1);
  config.actuators[0].name = "left";
  return config;
}

/// Has no drives, but words for their faults.
struct NoDrives final : hal::DriveMaster {
  std::vector<uint32_t> identifiers() const override { return {}; }
  void receive(const hal::Frame&, int64_t) noexcept override {}
  const hal::Measurement& measure(hal::BusHealth, int64_t) noexcept override { return measurement; }
  void command(const hal::Command&, int64_t, hal::FrameBatch&) noexcept override {}
  std::string describe(const hal::DriveFault& fault) const override { return hal::name(fault.kind); }
  hal::Measurement measurement;
};

}  // namespace tendril::app
