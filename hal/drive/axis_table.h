// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hal/bus/frame.h"
#include "hal/drive/master_config.h"

namespace tendril::hal {

/// Finds the axis that a received frame belongs to, by the 11-bit identifier of the frame. One byte for each
/// identifier.
class AxisTable {
 public:
  static constexpr int kNoAxis = -1;

  /// @param axes          at most 255, see kMaxAxes
  /// @param received_ids  gives the 11-bit identifiers of all frames that an axis receives from its drive; no
  ///                      two axes share one
  /// Real-time: no.
  template <class ReceivedIds>
  AxisTable(const std::vector<AxisConfig>& axes, ReceivedIds received_ids) {
    axis_of_.fill(kEmpty);
    for (size_t axis = 0; axis < axes.size(); ++axis)
      for (const uint32_t id : received_ids(axes[axis])) axis_of_.at(id) = static_cast<uint8_t>(axis);
  }

  /// The index of the axis; kNoAxis where the frame is none of a drive, as every frame with a 29-bit
  /// identifier. A remote frame belongs to the axis of its identifier. Real-time: yes.
  int find(const Frame& frame) const noexcept {
    if (frame.extended || frame.id >= kIdentifiers || axis_of_[frame.id] == kEmpty) return kNoAxis;
    return axis_of_[frame.id];
  }

 private:
  static constexpr size_t kIdentifiers = 0x800;
  static constexpr uint8_t kEmpty = 0xFF;

  std::array<uint8_t, kIdentifiers> axis_of_;
};

}  // namespace tendril::hal
