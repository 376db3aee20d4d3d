#include "hal/tracker.h"

#include <algorithm>
#include <cmath>

#include "hal/little_endian.h"

namespace tendril::hal {
namespace {

constexpr double kMetresPerCount = 10e-6;
constexpr int64_t kAgeUnit_ns = 10'000;

}  // namespace

std::optional<Frame> encode_tracker(uint32_t id, const TrackerSample& sample) noexcept {
  Frame frame{.id = id, .length = 8};
  for (int i = 0; i < 3; ++i) {
    const double counts = std::round(sample.position[i] / kMetresPerCount);
    if (!(std::abs(counts) <= 32767)) return std::nullopt;
    put(frame.data, 2 * i, static_cast<int16_t>(counts));
  }
  const int64_t age = std::clamp<int64_t>(sample.age_ns / kAgeUnit_ns, 0, 65535);
  put(frame.data, 6, static_cast<uint16_t>(age));
  return frame;
}

std::optional<TrackerSample> decode_tracker(const Frame& frame) noexcept {
  if (frame.length != 8) return std::nullopt;
  TrackerSample sample;
  for (int i = 0; i < 3; ++i) sample.position[i] = get<int16_t>(frame.data, 2 * i) * kMetresPerCount;
  sample.age_ns = get<uint16_t>(frame.data, 6) * kAgeUnit_ns;
  return sample;
}

}  // namespace tendril::hal
