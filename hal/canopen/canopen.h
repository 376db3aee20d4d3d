// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "hal/bus/frame.h"

/// The identifiers of CANopen, and the messages NMT, SYNC and heartbeat as bytes and as values. [CiA 301]
/// Real-time: yes, all of it.
namespace tendril::hal {

// The predefined connection set: a node's identifiers are these plus its number, 1..127.
inline constexpr uint32_t kNmtId = 0x000;
inline constexpr uint32_t kSyncId = 0x080;
inline constexpr uint32_t kEmergencyBase = 0x080;
inline constexpr uint32_t kTpdo1Base = 0x180;
inline constexpr uint32_t kRpdo1Base = 0x200;
inline constexpr uint32_t kSdoAnswerBase = 0x580;
inline constexpr uint32_t kSdoRequestBase = 0x600;
inline constexpr uint32_t kHeartbeatBase = 0x700;

/// Set in the COB-ID entry of a PDO that is switched off.
inline constexpr uint32_t kPdoInvalid = 0x8000'0000;

/// Whether an 11-bit identifier is reserved for NMT, SDO, node control or later use, so that no PDO may have
/// it. [CiA 301, restricted CAN-IDs] Real-time: yes.
constexpr bool is_restricted(uint32_t id) noexcept {
  return id < 0x080 || (id > 0x100 && id <= 0x180) || (id > 0x580 && id < 0x600) ||
         (id > 0x600 && id < 0x680) || (id >= 0x6E0 && id < 0x700) || id > 0x700;
}

/// Whether a frame has that 11-bit identifier and that many bytes of data. Real-time: yes.
inline bool is_message(const Frame& frame, uint32_t id, int length) noexcept {
  return frame.id == id && !frame.extended && frame.length == length;
}

enum class NmtCommand : uint8_t {
  kStart = 0x01,
  kStop = 0x02,
  kPreOperational = 0x80,
  kResetNode = 0x81,
  kResetCommunication = 0x82
};

enum class NmtState : uint8_t {
  kBootUp = 0x00,
  kStopped = 0x04,
  kOperational = 0x05,
  kPreOperational = 0x7F
};

/// A command of the NMT master. Node 0 means all.
struct NmtRequest {
  NmtCommand command = NmtCommand::kStart;
  int node = 0;
};

/// The frame of an NMT command. Real-time: yes.
Frame encode_nmt(NmtRequest request) noexcept;

/// Reads an NMT command. @return nothing where the frame is none or its command is unknown. Real-time: yes.
std::optional<NmtRequest> decode_nmt(const Frame& frame) noexcept;

/// SYNC without a counter (0x1019 = 0). Real-time: yes.
Frame encode_sync() noexcept;

/// A heartbeat of `node`; of kBootUp, its boot-up message. Real-time: yes.
Frame encode_heartbeat(int node, NmtState state) noexcept;

/// Reads a heartbeat or boot-up message. @return nothing where the frame is not one of `node`. Real-time:
/// yes.
std::optional<NmtState> decode_heartbeat(const Frame& frame, int node) noexcept;

}  // namespace tendril::hal
