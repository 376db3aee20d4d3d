#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "hal/bus/frame.h"

/// CANopen messages as bytes and as values [CiA 301]. Everything here is pure.
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

/// Whether an 11-bit identifier is kept for NMT, SDO, node control or later use, so that no PDO may have it.
/// [CiA 301, restricted CAN-IDs] Real-time: yes.
constexpr bool is_restricted(uint32_t id) noexcept {
  return id < 0x080 || (id > 0x100 && id <= 0x180) || (id > 0x580 && id < 0x600) ||
         (id > 0x600 && id < 0x680) || (id >= 0x6E0 && id < 0x700) || id > 0x700;
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

/// An order of the NMT master. Node 0 means all.
struct NmtRequest {
  NmtCommand command = NmtCommand::kStart;
  int node = 0;
};

/// The frame of an NMT order. Real-time: yes.
Frame encode_nmt(NmtRequest request) noexcept;

/// Reads an NMT order. @return nothing where the frame is none or its command is unknown. Real-time: yes.
std::optional<NmtRequest> decode_nmt(const Frame& frame) noexcept;

/// SYNC without a counter (0x1019 = 0). Real-time: yes.
Frame encode_sync() noexcept;

/// A heartbeat of `node`; of kBootUp, its boot-up message. Real-time: yes.
Frame encode_heartbeat(int node, NmtState state) noexcept;

/// Reads a heartbeat or boot-up message. @return nothing where the frame is not one of `node`. Real-time:
/// yes.
std::optional<NmtState> decode_heartbeat(const Frame& frame, int node) noexcept;

/// What a drive sends when an error appears, or with code 0 when the last one is gone.
struct Emergency {
  uint16_t code = 0;
  uint8_t error_register = 0;       // object 1001
  std::array<uint8_t, 5> detail{};  // the maker's
};

/// The EMCY frame of `node`. Real-time: yes.
Frame encode_emergency(int node, const Emergency& emergency) noexcept;

/// Reads an EMCY frame. @return nothing where the frame is none of `node`. Real-time: yes.
std::optional<Emergency> decode_emergency(const Frame& frame, int node) noexcept;

/// An EMCY error code in words, or its class where it is none of the usual ones [CiA 301, table of emergency
/// error codes; CiA 402 for 0x2000-0x8FFF]. Real-time: yes.
const char* describe_emergency(uint16_t code) noexcept;

/// Address of an entry of a drive's object dictionary.
struct ObjectAddress {
  uint16_t index = 0;
  uint8_t sub = 0;
  friend bool operator==(const ObjectAddress&, const ObjectAddress&) = default;
};

/// Reasons for which an SDO transfer ends early, with their codes on the wire.
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

/// As it stands in an SDO frame. Real-time: yes.
constexpr uint32_t code(SdoAbort abort) noexcept { return static_cast<uint32_t>(abort); }

/// The reason in words; codes of no known meaning say so. Real-time: yes.
const char* describe_sdo_abort(uint32_t code) noexcept;

/// What a client asks of a server: expedited transfers (up to 4 bytes), and to read longer objects in
/// segments.
struct SdoRequest {
  enum class Kind : uint8_t { kWrite, kRead, kReadSegment, kAbort, kOther };
  Kind kind = Kind::kOther;
  ObjectAddress object;  // not of kReadSegment
  int size = 0;          // kWrite: bytes, 1..4; 0 where the client did not say
  uint32_t value = 0;    // kWrite: the data; kAbort: the abort code
  bool toggle = false;   // kReadSegment: false for the first one, then alternating
};

/// What a server answers.
struct SdoAnswer {
  enum class Kind : uint8_t { kWritten, kValue, kSegmented, kSegment, kAbort, kOther };
  Kind kind = Kind::kOther;
  ObjectAddress object;  // not of kSegment
  int size = 0;          // kValue: bytes, 1..4; 0 where the server did not say; kSegment: bytes, 0..7
  // kValue: the data, zero-extended; kSegmented: bytes to come, 0 where the server did not say; kAbort: the
  // abort code
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

/// Reads an answer. @return nothing where the frame is no SDO answer of `node`; kOther for segmented writes
/// and block transfers. Real-time: yes.
std::optional<SdoAnswer> decode_sdo_answer(const Frame& frame, int node) noexcept;

}  // namespace tendril::hal
