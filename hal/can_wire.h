#pragma once

#include <linux/can.h>

#include <algorithm>
#include <cstring>

#include "hal/frame.h"

/// The kernel's struct can_frame, which both SocketCAN and the local socket carry. Private to hal.
namespace tendril::hal {

/// A data frame as the kernel takes it. Real-time: yes.
inline can_frame to_wire(const Frame& frame) noexcept {
  can_frame wire{};
  wire.can_id = frame.extended ? frame.id | CAN_EFF_FLAG : frame.id;
  wire.can_dlc = std::min<uint8_t>(frame.length, CAN_MAX_DLEN);
  std::memcpy(wire.data, frame.data.data(), wire.can_dlc);
  return wire;
}

/// A data frame as the kernel gives it.
/// @param wire      a data frame: no error frame, no remote frame
/// @param stamp_ns  when it arrived
/// Real-time: yes.
inline Frame from_wire(const can_frame& wire, int64_t stamp_ns) noexcept {
  Frame frame;
  frame.extended = (wire.can_id & CAN_EFF_FLAG) != 0;
  frame.id = wire.can_id & (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.length = std::min<uint8_t>(wire.can_dlc, CAN_MAX_DLEN);
  std::memcpy(frame.data.data(), wire.data, frame.length);
  frame.stamp_ns = stamp_ns;
  return frame;
}

}  // namespace tendril::hal
