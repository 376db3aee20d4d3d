// SPDX-License-Identifier: Apache-2.0
#include "hal/drive/drive_protocol.h"

namespace tendril::hal {

std::unique_ptr<DriveMaster> make_master(const MasterConfig& config) {
  return config.protocol->make_master(config);
}

std::vector<PeriodicFrames> periodic_frames(const MasterConfig& config) {
  std::vector<PeriodicFrames> frames = config.protocol->periodic_frames(config);
  for (const SensorConfig& sensor : config.sensors)
    frames.push_back({.length = sensor.length, .rate_hz = sensor.rate_hz, .extended = sensor.extended});
  return frames;
}

std::vector<FrameLayout> frame_layouts(const MasterConfig& config,
                                       const std::vector<DisplacementUnit>& units) {
  std::vector<FrameLayout> frames = config.protocol->bus_layouts(config);
  for (const SensorConfig& sensor : config.sensors) frames.push_back(sensor_layout(sensor));
  for (size_t i = 0; i < config.axes.size(); ++i)
    for (FrameLayout& layout : config.protocol->drive_layouts(config, static_cast<int>(i), units.at(i)))
      frames.push_back(std::move(layout));
  return frames;
}

}  // namespace tendril::hal
