#include "hal/canopen/canopen.h"

#include <algorithm>

#include "hal/bus/little_endian.h"

namespace tendril::hal {
namespace {

// SDO command specifiers: bits 7-5 of byte 0, with the flags of an expedited transfer below them.
constexpr uint8_t kDownload = 0x20, kUpload = 0x40, kDownloaded = 0x60, kAborted = 0x80;
constexpr uint8_t kUploadSegment = 0x60;  // a request; its answer has the specifier 0
constexpr uint8_t kToggleBit = 0x10, kLastSegment = 0x01;
constexpr uint8_t kSpecifier = 0xE0, kExpedited = 0x02, kSizeGiven = 0x01;

Frame sdo_frame(uint32_t id, uint8_t command, ObjectAddress object, uint32_t value) noexcept {
  Frame frame{.id = id, .length = 8};
  frame.data[0] = command;
  put(frame.data, 1, object.index);
  frame.data[3] = object.sub;
  put(frame.data, 4, value);
  return frame;
}

ObjectAddress object_of(const Frame& frame) noexcept { return {get<uint16_t>(frame.data, 1), frame.data[3]}; }

/// Command byte of an expedited transfer of `size` bytes: 2F, 2B, 27, 23 or 4F, 4B, 47, 43; 22 or 42 for size
/// 0.
uint8_t expedited(uint8_t specifier, int size) noexcept {
  const int flags = size == 0 ? kExpedited : ((4 - size) << 2) | kExpedited | kSizeGiven;
  return static_cast<uint8_t>(specifier | flags);
}

int size_of(uint8_t command) noexcept { return command & kSizeGiven ? 4 - ((command >> 2) & 3) : 0; }

uint32_t low_bytes(uint32_t value, int size) noexcept {
  return size == 0 || size == 4 ? value : value & ((1u << (8 * size)) - 1);
}

/// Up to seven bytes, with the number of those that are not used in bits 3-1.
Frame segment_frame(uint32_t id, const SdoAnswer& answer) noexcept {
  Frame frame{.id = id, .length = 8};
  frame.data[0] = static_cast<uint8_t>((answer.toggle ? kToggleBit : 0) | (7 - answer.size) << 1 |
                                       (answer.last ? kLastSegment : 0));
  std::copy_n(answer.segment.begin(), answer.size, frame.data.begin() + 1);
  return frame;
}

SdoAnswer segment_of(const Frame& frame) noexcept {
  const uint8_t command = frame.data[0];
  SdoAnswer answer{.kind = SdoAnswer::Kind::kSegment,
                   .object = {},
                   .size = 7 - ((command >> 1) & 7),
                   .value = 0,
                   .toggle = (command & kToggleBit) != 0,
                   .last = (command & kLastSegment) != 0};
  std::copy_n(frame.data.begin() + 1, answer.size, answer.segment.begin());
  return answer;
}

bool is_standard(const Frame& frame, uint32_t id, int length) noexcept {
  return frame.id == id && !frame.extended && frame.length == length;
}

}  // namespace

Frame encode_nmt(NmtRequest request) noexcept {
  Frame frame{.id = kNmtId, .length = 2};
  frame.data[0] = static_cast<uint8_t>(request.command);
  frame.data[1] = static_cast<uint8_t>(request.node);
  return frame;
}

std::optional<NmtRequest> decode_nmt(const Frame& frame) noexcept {
  if (!is_standard(frame, kNmtId, 2)) return std::nullopt;
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
  if (!is_standard(frame, kHeartbeatBase + node, 1)) return std::nullopt;
  return static_cast<NmtState>(frame.data[0] & 0x7F);  // bit 7 toggles in node guarding
}

Frame encode_emergency(int node, const Emergency& emergency) noexcept {
  Frame frame{.id = kEmergencyBase + node, .length = 8};
  put(frame.data, 0, emergency.code);
  frame.data[2] = emergency.error_register;
  std::copy(emergency.detail.begin(), emergency.detail.end(), frame.data.begin() + 3);
  return frame;
}

std::optional<Emergency> decode_emergency(const Frame& frame, int node) noexcept {
  if (!is_standard(frame, kEmergencyBase + node, 8)) return std::nullopt;
  Emergency emergency{.code = get<uint16_t>(frame.data, 0), .error_register = frame.data[2]};
  std::copy(frame.data.begin() + 3, frame.data.end(), emergency.detail.begin());
  return emergency;
}

Frame encode_sdo_request(int node, const SdoRequest& request) noexcept {
  const uint32_t id = kSdoRequestBase + node;
  switch (request.kind) {
    case SdoRequest::Kind::kWrite:
      return sdo_frame(id, expedited(kDownload, request.size), request.object,
                       low_bytes(request.value, request.size));
    case SdoRequest::Kind::kRead:
      return sdo_frame(id, kUpload, request.object, 0);
    case SdoRequest::Kind::kReadSegment:
      return sdo_frame(id, kUploadSegment | (request.toggle ? kToggleBit : 0), {}, 0);
    default:
      return sdo_frame(id, kAborted, request.object, request.value);
  }
}

std::optional<SdoRequest> decode_sdo_request(const Frame& frame, int node) noexcept {
  if (!is_standard(frame, kSdoRequestBase + node, 8)) return std::nullopt;
  const uint8_t command = frame.data[0];
  SdoRequest request{.object = object_of(frame), .value = get<uint32_t>(frame.data, 4)};
  if ((command & kSpecifier) == kDownload && (command & kExpedited)) {
    request.kind = SdoRequest::Kind::kWrite;
    request.size = size_of(command);
    request.value = low_bytes(request.value, request.size);
  } else if ((command & kSpecifier) == kUpload) {
    request.kind = SdoRequest::Kind::kRead;
  } else if ((command & kSpecifier) == kUploadSegment) {
    request = {.kind = SdoRequest::Kind::kReadSegment, .object = {}, .toggle = (command & kToggleBit) != 0};
  } else if ((command & kSpecifier) == kAborted) {
    request.kind = SdoRequest::Kind::kAbort;
  }
  return request;
}

Frame encode_sdo_answer(int node, const SdoAnswer& answer) noexcept {
  const uint32_t id = kSdoAnswerBase + node;
  switch (answer.kind) {
    case SdoAnswer::Kind::kWritten:
      return sdo_frame(id, kDownloaded, answer.object, 0);
    case SdoAnswer::Kind::kValue:
      return sdo_frame(id, expedited(kUpload, answer.size), answer.object,
                       low_bytes(answer.value, answer.size));
    case SdoAnswer::Kind::kSegmented:
      return sdo_frame(id, kUpload | (answer.value != 0 ? kSizeGiven : 0), answer.object, answer.value);
    case SdoAnswer::Kind::kSegment:
      return segment_frame(id, answer);
    default:
      return sdo_frame(id, kAborted, answer.object, answer.value);
  }
}

std::optional<SdoAnswer> decode_sdo_answer(const Frame& frame, int node) noexcept {
  if (!is_standard(frame, kSdoAnswerBase + node, 8)) return std::nullopt;
  const uint8_t command = frame.data[0];
  if ((command & kSpecifier) == 0) return segment_of(frame);
  SdoAnswer answer{.object = object_of(frame), .value = get<uint32_t>(frame.data, 4)};
  if ((command & kSpecifier) == kDownloaded) {
    answer.kind = SdoAnswer::Kind::kWritten;
  } else if ((command & kSpecifier) == kUpload && (command & kExpedited)) {
    answer.kind = SdoAnswer::Kind::kValue;
    answer.size = size_of(command);
    answer.value = low_bytes(answer.value, answer.size);
  } else if ((command & kSpecifier) == kUpload) {
    answer.kind = SdoAnswer::Kind::kSegmented;
    if (!(command & kSizeGiven)) answer.value = 0;
  } else if ((command & kSpecifier) == kAborted) {
    answer.kind = SdoAnswer::Kind::kAbort;
  }
  return answer;
}

const char* describe_sdo_abort(uint32_t code) noexcept {
  switch (static_cast<SdoAbort>(code)) {
    case SdoAbort::kToggle:
      return "toggle bit not alternated";
    case SdoAbort::kTimeout:
      return "no answer in time";
    case SdoAbort::kUnknownCommand:
      return "command not known";
    case SdoAbort::kOutOfMemory:
      return "out of memory";
    case SdoAbort::kUnsupportedAccess:
      return "access to this object not supported";
    case SdoAbort::kWriteOnly:
      return "object is write-only";
    case SdoAbort::kReadOnly:
      return "object is read-only";
    case SdoAbort::kNoObject:
      return "no such object";
    case SdoAbort::kNotMappable:
      return "object cannot be mapped into a PDO";
    case SdoAbort::kPdoTooLong:
      return "mapped objects are longer than a PDO";
    case SdoAbort::kIncompatible:
      return "parameters do not go together";
    case SdoAbort::kHardware:
      return "hardware error";
    case SdoAbort::kWrongLength:
      return "data of the wrong length";
    case SdoAbort::kTooLong:
      return "data too long";
    case SdoAbort::kTooShort:
      return "data too short";
    case SdoAbort::kNoSubindex:
      return "no such subindex";
    case SdoAbort::kBadValue:
      return "value not allowed";
    case SdoAbort::kValueTooHigh:
      return "value too high";
    case SdoAbort::kValueTooLow:
      return "value too low";
    case SdoAbort::kGeneral:
      return "general error";
    case SdoAbort::kCannotStore:
      return "data cannot be stored";
    case SdoAbort::kLocalControl:
      return "refused because of local control";
    case SdoAbort::kDeviceState:
      return "refused in the present device state";
  }
  return "abort code of no known meaning";
}

const char* describe_emergency(uint16_t code) noexcept {
  switch (code) {
    case 0x0000:
      return "error reset or no error";
    case 0x2310:
      return "continuous overcurrent at the output";
    case 0x2320:
      return "short circuit or earth leakage at the output";
    case 0x3110:
      return "mains overvoltage";
    case 0x3120:
      return "mains undervoltage";
    case 0x3210:
      return "overvoltage of the DC link";
    case 0x3220:
      return "undervoltage of the DC link";
    case 0x4210:
      return "device too hot";
    case 0x4310:
      return "drive too hot";
    case 0x5530:
      return "non-volatile memory";
    case 0x6010:
      return "software reset by the watchdog";
    case 0x6320:
      return "parameter error";
    case 0x7121:
      return "motor blocked";
    case 0x7122:
      return "motor or commutation";
    case 0x7305:
      return "incremental encoder 1";
    case 0x8110:
      return "CAN overrun";
    case 0x8120:
      return "CAN error-passive";
    case 0x8130:
      return "heartbeat of the master lost";
    case 0x8140:
      return "recovered from bus-off";
    case 0x8150:
      return "two senders of one COB-ID";
    case 0x8210:
      return "PDO too short";
    case 0x8220:
      return "PDO too long";
    case 0x8250:
      return "time-out of an RPDO";
    case 0x8611:
      return "following error";
    case 0x8612:
      return "reference limit";
    default:
      break;
  }
  switch (code >> 8) {
    case 0x21:
      return "current on the input side";
    case 0x22:
      return "current inside the drive";
    case 0x23:
      return "current on the output side";
    case 0x31:
      return "mains voltage";
    case 0x32:
      return "voltage inside the drive";
    case 0x33:
      return "output voltage";
    case 0x41:
      return "ambient temperature";
    case 0x42:
      return "device temperature";
    case 0x43:
      return "drive temperature";
    case 0x44:
      return "supply temperature";
    case 0x51:
      return "supply of the drive's electronics";
    case 0x52:
      return "control electronics";
    case 0x53:
      return "operating unit";
    case 0x54:
      return "power section";
    case 0x55:
      return "data storage";
    case 0x61:
      return "internal software";
    case 0x62:
      return "user software";
    case 0x63:
      return "data set";
    case 0x71:
      return "power stage";
    case 0x72:
      return "measuring circuit";
    case 0x73:
      return "sensor or encoder";
    case 0x74:
      return "computing circuit";
    case 0x75:
      return "communication circuit";
    case 0x81:
      return "communication";
    case 0x82:
      return "protocol";
    case 0x83:
      return "torque controller";
    case 0x84:
      return "speed controller";
    case 0x85:
      return "position controller";
    case 0x86:
      return "positioning";
    case 0x90:
      return "external error";
    default:
      break;
  }
  switch (code >> 12) {
    case 0x1:
      return "generic error";
    case 0x2:
      return "current";
    case 0x3:
      return "voltage";
    case 0x4:
      return "temperature";
    case 0x5:
      return "drive hardware";
    case 0x6:
      return "drive software";
    case 0x7:
      return "additional module";
    case 0x8:
      return "monitoring";
    case 0xF:
      return "additional function";
    default:
      return "error of no known class";
  }
}

}  // namespace tendril::hal
