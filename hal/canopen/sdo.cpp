// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/sdo.h"

#include <algorithm>

#include "hal/bus/little_endian.h"
#include "hal/canopen/canopen.h"

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

}  // namespace

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
  if (!is_message(frame, kSdoRequestBase + node, 8)) return std::nullopt;
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

/// Some drives leave out the bytes at the end of an answer that mean nothing.
std::optional<SdoAnswer> decode_sdo_answer(const Frame& received, int node) noexcept {
  constexpr int kHeader = 4, kWhole = 8;  // bytes
  const int length = received.length;
  const bool is_answer = received.id == kSdoAnswerBase + node && !received.extended && !received.remote;
  if (!is_answer || length == 0 || length > kWhole) return std::nullopt;
  Frame frame;
  std::copy_n(received.data.begin(), length, frame.data.begin());
  const uint8_t command = frame.data[0];
  if ((command & kSpecifier) == 0) {
    const SdoAnswer segment = segment_of(frame);
    return length > segment.size ? std::optional(segment) : std::nullopt;
  }
  if (length < kHeader) return std::nullopt;
  SdoAnswer answer{.object = object_of(frame), .value = get<uint32_t>(frame.data, 4)};
  if ((command & kSpecifier) == kDownloaded) {
    answer.kind = SdoAnswer::Kind::kWritten;
  } else if ((command & kSpecifier) == kUpload && (command & kExpedited)) {
    answer.kind = SdoAnswer::Kind::kValue;
    answer.size = size_of(command);
    answer.value = low_bytes(answer.value, answer.size);
    if (length < kHeader + answer.size) return std::nullopt;
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

}  // namespace tendril::hal
