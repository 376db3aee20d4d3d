// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

// The finger of a Workbench, as its robot file describes it.
namespace tendril::app {

inline const std::vector<int> kNodes{1, 2};
inline const std::string kCables[] = {"right", "left"};                   // of these nodes
inline constexpr double kCount_m = 2 * std::numbers::pi * 0.005 / 65536;  // of its encoders
inline constexpr double kTopSpeed = 0.03, kPeriod = 1 / 200.0;            // m/s and s on the bench
inline constexpr uint32_t kCamera = 0x1F0, kSync = 0x080;  // come by the plant's clock and the daemon's

}  // namespace tendril::app
