#pragma once

#include <linux/can.h>

#include <algorithm>
#include <cstring>

#include "hal/bus/frame.h"

/// The kernel's struct can_frame, which both SocketCAN and the local socket carry. Private to hal.
namespace tendril::hal {

/// A frame as the kernel takes it. Real-time: yes.
inline can_frame to_wire(const Frame& frame) noexcept {
  can_frame wire{};
  wire.can_id = frame.extended ? frame.id | CAN_EFF_FLAG : frame.id;
  if (frame.remote) {
    wire.can_id |= CAN_RTR_FLAG;
    return wire;
  }
  wire.can_dlc = std::min<uint8_t>(frame.length, CAN_MAX_DLEN);
  std::memcpy(wire.data, frame.data.data(), wire.can_dlc);
  return wire;
}

/// A frame as the kernel gives it.
/// @param wire      no error frame
/// @param stamp_ns  when it arrived
/// Real-time: yes.
inline Frame from_wire(const can_frame& wire, int64_t stamp_ns) noexcept {
  Frame frame;
  frame.extended = (wire.can_id & CAN_EFF_FLAG) != 0;
  frame.id = wire.can_id & (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.stamp_ns = stamp_ns;
  frame.remote = (wire.can_id & CAN_RTR_FLAG) != 0;
  if (frame.remote) return frame;  // its length is that of the frame it asks for
  frame.length = std::min<uint8_t>(wire.can_dlc, CAN_MAX_DLEN);
  std::memcpy(frame.data.data(), wire.data, frame.length);
  return frame;
}

}  // namespace tendril::hal
