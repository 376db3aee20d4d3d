// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "hal/bus/frame.h"

/// SDO requests and answers as bytes and as values. [CiA 301, service data object]
namespace tendril::hal {

/// Address of an entry of a drive's object dictionary.
struct ObjectAddress {
  uint16_t index = 0;
  uint8_t sub = 0;
  friend bool operator==(const ObjectAddress&, const ObjectAddress&) = default;
};

/// Reasons to abort an SDO transfer, with their codes. [CiA 301]
enum class SdoAbort : uint32_t {
  kToggle = 0x0503'0000,
  kTimeout = 0x0504'0000,
  kUnknownCommand = 0x0504'0001,
  kOutOfMemory = 0x0504'0005,
  kUnsupportedAccess = 0x0601'0000,
  kWriteOnly = 0x0601'0001,
  kReadOnly = 0x0601'0002,
  kNoObject = 0x0602'0000,
  kNotMappable = 0x0604'0041,
  kPdoTooLong = 0x0604'0042,
  kIncompatible = 0x0604'0043,
  kHardware = 0x0606'0000,
  kWrongLength = 0x0607'0010,
  kTooLong = 0x0607'0012,
  kTooShort = 0x0607'0013,
  kNoSubindex = 0x0609'0011,
  kBadValue = 0x0609'0030,
  kValueTooHigh = 0x0609'0031,
  kValueTooLow = 0x0609'0032,
  kGeneral = 0x0800'0000,
  kCannotStore = 0x0800'0020,
  kLocalControl = 0x0800'0021,
  kDeviceState = 0x0800'0022
};

/// The code as in an SDO frame. Real-time: yes.
constexpr uint32_t code(SdoAbort abort) noexcept { return static_cast<uint32_t>(abort); }

/// The reason in words; codes of no known meaning say so. Real-time: yes.
const char* describe_sdo_abort(uint32_t code) noexcept;

/// A request of an SDO client: expedited transfers (up to 4 bytes), and segmented reads of longer objects.
struct SdoRequest {
  enum class Kind : uint8_t { kWrite, kRead, kReadSegment, kAbort, kOther };
  Kind kind = Kind::kOther;
  ObjectAddress object;  // not used by kReadSegment
  int size = 0;          // kWrite: bytes, 1..4; 0: not indicated
  uint32_t value = 0;    // kWrite: the data; kAbort: the abort code
  bool toggle = false;   // kReadSegment: false for the first one, then alternating
};

/// The answer of an SDO server.
struct SdoAnswer {
  enum class Kind : uint8_t { kWritten, kValue, kSegmented, kSegment, kAbort, kOther };
  Kind kind = Kind::kOther;
  ObjectAddress object;  // not used by kSegment
  int size = 0;          // kValue: bytes, 1..4; 0: not indicated; kSegment: bytes, 0..7
  // kValue: the data, zero-extended; kSegmented: bytes to come, 0: not indicated; kAbort: the abort code
  uint32_t value = 0;
  bool toggle = false;  // kSegment: that of the request
  bool last = false;    // kSegment: none follows
  std::array<uint8_t, 7> segment{};
};

/// The frame of a request.
/// @param node     the server's number
/// @param request  not kOther
/// Real-time: yes.
Frame encode_sdo_request(int node, const SdoRequest& request) noexcept;

/// Reads a request. @return nothing where the frame is no SDO request to `node`; kOther for segmented writes
/// and block transfers. Real-time: yes.
std::optional<SdoRequest> decode_sdo_request(const Frame& frame, int node) noexcept;

/// The frame of an answer.
/// @param node    the server's number
/// @param answer  not kOther
/// Real-time: yes.
Frame encode_sdo_answer(int node, const SdoAnswer& answer) noexcept;

/// Reads an answer. It may be shorter than 8 bytes, if no byte is missing that means something.
/// @return nothing where the frame is no SDO answer of `node`; kOther for segmented writes and block
/// transfers. Real-time: yes.
std::optional<SdoAnswer> decode_sdo_answer(const Frame& frame, int node) noexcept;

}  // namespace tendril::hal
