// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "hal/bus/frame.h"

namespace tendril::hal {

/// The frames one cycle wants on the bus, in the order in which they must go out.
class FrameBatch {
 public:
  /// What a master with 32 axes can ask for in one cycle, with room to spare: 32 PDOs, 32 NMT or SDO frames,
  /// heartbeat and SYNC.
  static constexpr int kCapacity = 96;

  /// Appends a frame. @return false where the batch is full; the frame is then dropped and counted
  /// Real-time: yes (no allocation).
  bool push(const Frame& frame) noexcept {
    if (size_ == kCapacity) {
      ++dropped_;
      return false;
    }
    frames_[size_++] = frame;
    return true;
  }

  /// Forgets the frames; the count of dropped ones stays. Real-time: yes.
  void clear() noexcept { size_ = 0; }

  /// Frames held. Real-time: yes.
  int size() const noexcept { return size_; }

  /// Frames that found the batch full since construction. Real-time: yes.
  uint64_t dropped() const noexcept { return dropped_; }

  /// Frame i of size(). Real-time: yes.
  const Frame& operator[](int i) const noexcept { return frames_[i]; }

  /// The frames in their order, for a range-based for. Real-time: yes.
  const Frame* begin() const noexcept { return frames_.data(); }
  const Frame* end() const noexcept { return frames_.data() + size_; }

 private:
  std::array<Frame, kCapacity> frames_{};
  int size_ = 0;
  uint64_t dropped_ = 0;
};

}  // namespace tendril::hal
