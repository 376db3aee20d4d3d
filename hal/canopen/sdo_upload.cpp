// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/sdo_upload.h"

#include <algorithm>

namespace tendril::hal {

void SdoUpload::start(ObjectAddress object) noexcept {
  object_ = object;
  status_ = Status::kRunning;
  attempt_ = 0;
  failure_ = abort_ = 0;
  begin();
}

void SdoUpload::begin() noexcept {
  ++attempt_;
  awaits_answer_ = in_segments_ = toggle_ = false;
  size_ = 0;
}

void SdoUpload::receive(const SdoAnswer& answer) noexcept {
  if (status_ != Status::kRunning || !awaits_answer_) return;
  if (answer.kind == SdoAnswer::Kind::kSegment) {
    if (in_segments_) take_segment(answer);
    return;
  }
  if (!(answer.object == object_)) return;
  if (answer.kind == SdoAnswer::Kind::kAbort) {
    end(Status::kFailed, answer.value);
  } else if (answer.kind == SdoAnswer::Kind::kValue && !in_segments_) {
    std::array<uint8_t, 4> bytes{};
    for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<uint8_t>(answer.value >> (8 * i));
    append(bytes.data(), answer.size == 0 ? 4 : answer.size);
    end(Status::kDone, 0);
  } else if (answer.kind == SdoAnswer::Kind::kSegmented && !in_segments_) {
    in_segments_ = true;
    awaits_answer_ = false;
  }
}

void SdoUpload::take_segment(const SdoAnswer& answer) noexcept {
  if (answer.toggle != toggle_) {
    abort_ = code(SdoAbort::kToggle);
    return end(Status::kFailed, abort_);
  }
  append(answer.segment.data(), answer.size);
  awaits_answer_ = false;
  toggle_ = !toggle_;
  if (answer.last) return end(Status::kDone, 0);
  if (answer.size == 0) {  // such segments could come without end
    abort_ = code(SdoAbort::kGeneral);
    return end(Status::kFailed, abort_);
  }
  if (size_ < kCapacity) return;
  abort_ = code(SdoAbort::kOutOfMemory);
  end(Status::kDone, 0);
}

void SdoUpload::append(const uint8_t* bytes, int count) noexcept {
  for (int i = 0; i < count && size_ < kCapacity; ++i) text_[size_++] = static_cast<char>(bytes[i]);
}

void SdoUpload::end(Status status, uint32_t failure) noexcept {
  status_ = status;
  failure_ = failure;
}

SdoUpload::Status SdoUpload::advance(int64_t now_ns, FrameBatch& out) noexcept {
  if (status_ == Status::kRunning && awaits_answer_ && now_ns - requested_ns_ >= timeout_ns_) {
    abort_ = code(SdoAbort::kTimeout);
    if (attempt_ == attempts_)
      end(Status::kFailed, abort_);
    else
      begin();
  }
  if (abort_ != 0) {  // the drive must end a transfer before the next one
    out.push(encode_sdo_request(
        node_, {.kind = SdoRequest::Kind::kAbort, .object = object_, .size = 0, .value = abort_}));
    abort_ = 0;
    return status_;
  }
  if (status_ != Status::kRunning || awaits_answer_) return status_;
  awaits_answer_ = true;
  requested_ns_ = now_ns;
  const auto kind = in_segments_ ? SdoRequest::Kind::kReadSegment : SdoRequest::Kind::kRead;
  out.push(
      encode_sdo_request(node_, {.kind = kind, .object = object_, .size = 0, .value = 0, .toggle = toggle_}));
  return status_;
}

}  // namespace tendril::hal
