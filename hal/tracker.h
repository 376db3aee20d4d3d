#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "hal/frame.h"

namespace tendril::hal {

/// One sighting of the effector by the external camera.
struct TrackerSample {
  std::array<double, 3> position{};  // m, robot's frame, each within ±0.32767
  int64_t age_ns = 0;                // from exposure to sending, saturates at 655.35 ms
};

/// Packs a sighting: x, y, z as i16 in 10 µm, then the age as u16 in 10 µs, little endian, 8 bytes.
/// @param id  11-bit identifier of the tracker's frames
/// @return nothing where the position is not finite or does not fit: no sighting is better than a clipped one
/// Real-time: yes.
std::optional<Frame> encode_tracker(uint32_t id, const TrackerSample& sample) noexcept;

/// Unpacks a sighting. @return nothing where the frame is not 8 bytes long
/// Real-time: yes.
std::optional<TrackerSample> decode_tracker(const Frame& frame) noexcept;

}  // namespace tendril::hal
