// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/sdo_sequence.h"

namespace tendril::hal {
namespace {

/// The value of an object of up to four bytes.
uint32_t value_of(std::string_view bytes) noexcept {
  uint32_t value = 0;
  for (size_t i = 0; i < bytes.size() && i < 4; ++i)
    value |= static_cast<uint32_t>(static_cast<uint8_t>(bytes[i])) << (8 * i);
  return value;
}

uint32_t bits_of(int size) noexcept { return size == 0 || size >= 4 ? 0xFFFF'FFFF : (1u << (8 * size)) - 1; }

bool is_write_only(uint32_t abort) noexcept { return abort == static_cast<uint32_t>(SdoAbort::kWriteOnly); }

bool is_tolerated(Tolerance tolerance, bool reads) noexcept {
  return tolerance == Tolerance::kAny || (tolerance == Tolerance::kUnreadable && reads);
}

}  // namespace

void SdoSequence::start(std::span<const SdoStep> steps) noexcept {
  steps_ = steps;
  at_ = 0;
  status_ = steps.empty() ? Status::kDone : Status::kRunning;
  failure_ = 0;
  if (!steps.empty()) begin_step();
}

void SdoSequence::begin_step() noexcept {
  attempt_ = 0;
  value_differs_ = uploading_ = written_ = false;
  reads_ = request().kind == SdoRequest::Kind::kRead || steps_[at_].only_if_different;
}

void SdoSequence::receive(const SdoAnswer& answer) noexcept {
  if (status_ != Status::kRunning || attempt_ == 0) return;
  if (uploading_) return upload_.receive(answer);
  if (reads_ || !(answer.object == request().object)) return;
  if (answer.kind == SdoAnswer::Kind::kWritten) on_written();
  if (answer.kind == SdoAnswer::Kind::kAbort) refuse(answer.value);
}

SdoSequence::Status SdoSequence::advance(int64_t now_ns, FrameBatch& out) noexcept {
  if (status_ != Status::kRunning || (uploading_ && uploads(now_ns, out))) return status_;
  if (status_ != Status::kRunning) return status_;
  if (attempt_ > 0 && now_ns - requested_ns_ < timeout_ns_) return status_;
  if (attempt_ == attempts_) {
    status_ = Status::kFailed;
    failure_ = value_differs_ ? 0 : static_cast<uint32_t>(SdoAbort::kTimeout);
    return status_;
  }
  send_request(now_ns, out);
  return status_;
}

void SdoSequence::send_request(int64_t now_ns, FrameBatch& out) noexcept {
  ++attempt_;
  requested_ns_ = now_ns;
  uploading_ = reads_;
  if (reads_) {
    upload_.start(request().object);
    upload_.advance(now_ns, out);
  } else {
    out.push(encode_sdo_request(node_, request()));
  }
}

/// Goes on with an upload. @return whether `advance` has nothing more to do in this call
bool SdoSequence::uploads(int64_t now_ns, FrameBatch& out) noexcept {
  const SdoUpload::Status status = upload_.advance(now_ns, out);
  if (status == SdoUpload::Status::kRunning) return true;
  uploading_ = false;
  if (status == SdoUpload::Status::kDone) {
    judge(value_of(upload_.text()));
    return false;
  }
  // An upload that was not answered has just been aborted with a frame; it is repeated in the next call.
  if (upload_.failure() == static_cast<uint32_t>(SdoAbort::kTimeout)) return true;
  refuse(upload_.failure());
  return false;
}

void SdoSequence::on_written() noexcept {
  if (!steps_[at_].verify) return next_step();
  written_ = reads_ = true;
  attempt_ = 0;
}

void SdoSequence::judge(uint32_t value) noexcept {
  const SdoStep& step = steps_[at_];
  found_ = value;
  const uint32_t bits = reads_back() ? step.mask & bits_of(step.request.size) : step.mask;
  const bool differs = ((value ^ expected()) & bits) != 0;
  if (!differs) return next_step();
  if (reads_back() && !written_) {  // only_if_different
    reads_ = false;
    attempt_ = 0;
  } else {
    value_differs_ = true;
  }
}

void SdoSequence::refuse(uint32_t abort) noexcept {
  if (written_ && is_write_only(abort)) return next_step();
  if (!written_ && is_tolerated(steps_[at_].tolerance, reads_)) return next_step();
  status_ = Status::kFailed;
  failure_ = abort;
}

void SdoSequence::next_step() noexcept {
  if (at_ + 1 == steps_.size()) {
    status_ = Status::kDone;
  } else {
    ++at_;
    begin_step();
  }
}

}  // namespace tendril::hal
