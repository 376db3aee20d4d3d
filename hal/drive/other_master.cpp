// SPDX-License-Identifier: Apache-2.0
#include "hal/drive/other_master.h"

#include <algorithm>

namespace tendril::hal {

OtherMaster::OtherMaster(const std::vector<uint32_t>& ids, int64_t listen_ns) : listen_ns_(listen_ns) {
  for (const uint32_t id : ids) counts_.push_back({.id = id});
}

bool OtherMaster::receive(const Frame& frame, int64_t arrival_ns) noexcept {
  if (frame.remote || frame.extended) return false;
  const auto count = std::ranges::find(counts_, frame.id, &Count::id);
  if (count == counts_.end()) return false;
  if (ended_ || heard() || listen_ns_ == 0) return true;
  if (count->frames == 0 || arrival_ns - count->since_ns > listen_ns_) *count = {frame.id, 0, arrival_ns};
  if (++count->frames >= kEnough) heard_id_ = frame.id;
  return true;
}

bool OtherMaster::listening(int64_t now_ns) noexcept {
  if (!begun_) begun_ns_ = now_ns;
  begun_ = true;
  return !ended_ && now_ns - begun_ns_ < listen_ns_;
}

void OtherMaster::restart() noexcept {
  begun_ = ended_ = false;
  heard_id_ = kNone;
  for (Count& count : counts_) count.frames = 0;
}

}  // namespace tendril::hal
