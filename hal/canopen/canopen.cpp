// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/canopen.h"

namespace tendril::hal {

Frame encode_nmt(NmtRequest request) noexcept {
  Frame frame{.id = kNmtId, .length = 2};
  frame.data[0] = static_cast<uint8_t>(request.command);
  frame.data[1] = static_cast<uint8_t>(request.node);
  return frame;
}

std::optional<NmtRequest> decode_nmt(const Frame& frame) noexcept {
  if (!is_message(frame, kNmtId, 2)) return std::nullopt;
  const auto command = static_cast<NmtCommand>(frame.data[0]);
  switch (command) {
    case NmtCommand::kStart:
    case NmtCommand::kStop:
    case NmtCommand::kPreOperational:
    case NmtCommand::kResetNode:
    case NmtCommand::kResetCommunication:
      return NmtRequest{command, frame.data[1]};
  }
  return std::nullopt;
}

Frame encode_sync() noexcept { return {.id = kSyncId}; }

Frame encode_heartbeat(int node, NmtState state) noexcept {
  Frame frame{.id = kHeartbeatBase + node, .length = 1};
  frame.data[0] = static_cast<uint8_t>(state);
  return frame;
}

std::optional<NmtState> decode_heartbeat(const Frame& frame, int node) noexcept {
  if (!is_message(frame, kHeartbeatBase + node, 1)) return std::nullopt;
  return static_cast<NmtState>(frame.data[0] & 0x7F);  // bit 7 toggles in node guarding
}

}  // namespace tendril::hal
