#include "hal/sdo_sequence.h"

namespace tendril::hal {

void SdoSequence::start(std::span<const SdoStep> steps) noexcept {
  steps_ = steps;
  at_ = 0;
  status_ = steps.empty() ? Status::kDone : Status::kRunning;
  attempt_ = 0;
  failure_ = 0;
  other_value_ = false;
}

void SdoSequence::receive(const SdoAnswer& answer) noexcept {
  if (status_ != Status::kRunning || attempt_ == 0) return;
  const SdoStep& step = steps_[at_];
  if (!(answer.object == step.request.object)) return;
  const bool write = step.request.kind == SdoRequest::Kind::kWrite;
  switch (answer.kind) {
    case SdoAnswer::Kind::kAbort:
      status_ = Status::kFailed;
      failure_ = answer.value;
      break;
    case SdoAnswer::Kind::kWritten:
      if (write) next_step();
      break;
    case SdoAnswer::Kind::kValue:
      if (write) break;
      found_ = answer.value;
      other_value_ = ((answer.value ^ step.expected) & step.mask) != 0;
      if (!other_value_) next_step();
      break;
    default:  // what is compared here fits four bytes
      break;
  }
}

SdoSequence::Status SdoSequence::advance(int64_t now_ns, FrameBatch& out) noexcept {
  if (status_ != Status::kRunning) return status_;
  if (attempt_ > 0 && now_ns - asked_ns_ < timeout_ns_) return status_;
  if (attempt_ == attempts_) {
    status_ = Status::kFailed;
    failure_ = other_value_ ? 0 : static_cast<uint32_t>(SdoAbort::kTimeout);
    return status_;
  }
  ++attempt_;
  asked_ns_ = now_ns;
  out.push(encode_sdo_request(node_, steps_[at_].request));
  return status_;
}

void SdoSequence::next_step() noexcept {
  attempt_ = 0;
  other_value_ = false;
  if (at_ + 1 == steps_.size())
    status_ = Status::kDone;
  else
    ++at_;
}

}  // namespace tendril::hal
