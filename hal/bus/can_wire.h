// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <algorithm>
#include <cstring>

#include "hal/bus/frame.h"

/// The kernel's structures for CAN frames, which both SocketCAN and the local socket carry. Private to hal.
namespace tendril::hal {

/// A frame as the kernel takes it.
/// @tparam Wire  can_frame, for up to 8 bytes, or canfd_frame
/// Real-time: yes.
template <class Wire>
Wire to_wire(const Frame& frame) noexcept {
  Wire wire{};
  wire.can_id = frame.extended ? frame.id | CAN_EFF_FLAG : frame.id;
  if (frame.remote) {
    wire.can_id |= CAN_RTR_FLAG;
    return wire;
  }
  wire.len = std::min<uint8_t>(frame.length, sizeof wire.data);
  std::memcpy(wire.data, frame.data.data(), wire.len);
  return wire;
}

/// A frame as the kernel gives it.
/// @param wire      no error frame
/// @param stamp_ns  when it arrived
/// Real-time: yes.
template <class Wire>
Frame from_wire(const Wire& wire, int64_t stamp_ns) noexcept {
  Frame frame;
  frame.extended = (wire.can_id & CAN_EFF_FLAG) != 0;
  frame.id = wire.can_id & (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.stamp_ns = stamp_ns;
  frame.remote = (wire.can_id & CAN_RTR_FLAG) != 0;
  if (frame.remote) return frame;  // its length is that of the frame it asks for
  frame.length = std::min<uint8_t>(wire.len, sizeof wire.data);
  std::memcpy(frame.data.data(), wire.data, frame.length);
  return frame;
}

}  // namespace tendril::hal
