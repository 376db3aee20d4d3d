// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "hal/bus/frame_batch.h"
#include "hal/canopen/sdo.h"
#include "hal/canopen/sdo_upload.h"

namespace tendril::hal {

/// Which refusals of a step are tolerated.
enum class Tolerance : uint8_t {
  kNone,
  kUnreadable,  // any to read it: the drive has no such object, or does not show it
  kAny
};

/// One entry to write, or to read and compare.
struct SdoStep {
  SdoRequest request;
  uint32_t expected = 0;           // kRead: the value that the drive must have,
  uint32_t mask = 0xFFFF'FFFF;     // in these bits
  bool only_if_different = false;  // kWrite: read first, and written only if the value is different
  bool verify = false;  // kWrite: read back, and must then be what was written, in the bits of `mask`
  Tolerance tolerance = Tolerance::kNone;
};

/// An SDO client for a list of transfers with one drive, one transfer at a time. No function waits.
///
/// A transfer that is not answered in time is repeated; a late answer to the first request then counts for
/// the second. A read of another value than expected counts as not answered. What cannot be read back, as it
/// is write-only, counts as written. Values have four bytes at most, which a drive may also send in segments.
class SdoSequence {
 public:
  enum class Status : uint8_t { kRunning, kDone, kFailed };

  /// @param node        the drive, 1..127
  /// @param timeout_ns  for each attempt
  /// @param attempts    at each step, at least 1
  SdoSequence(int node, int64_t timeout_ns, int attempts) noexcept
      : node_(node), timeout_ns_(timeout_ns), attempts_(attempts), upload_(node, timeout_ns, 1) {}

  /// Begins a list, which must outlive its execution. Real-time: yes.
  void start(std::span<const SdoStep> steps) noexcept;

  /// Processes an answer of the drive; one that belongs to no open request is ignored. Real-time: yes.
  void receive(const SdoAnswer& answer) noexcept;

  /// Sends the next request if one is due: at most one frame. Real-time: yes (bounded, no allocation).
  Status advance(int64_t now_ns, FrameBatch& out) noexcept;

  /// kFailed: the abort code, SdoAbort::kTimeout where no answer came, or 0 where a read gave another value,
  /// see `found`. Real-time: yes.
  uint32_t failure() const noexcept { return failure_; }

  /// The value of the last read. Real-time: yes.
  uint32_t found() const noexcept { return found_; }

  /// kFailed: the step concerned, and the value that was expected where it read another. Real-time: yes.
  const SdoStep& step() const noexcept { return steps_[at_]; }
  uint32_t expected() const noexcept { return reads_back() ? request().value : steps_[at_].expected; }

 private:
  const SdoRequest& request() const noexcept { return steps_[at_].request; }
  bool reads_back() const noexcept { return request().kind == SdoRequest::Kind::kWrite; }
  void begin_step() noexcept;
  void next_step() noexcept;
  void send_request(int64_t now_ns, FrameBatch& out) noexcept;
  bool uploads(int64_t now_ns, FrameBatch& out) noexcept;
  void on_written() noexcept;
  void judge(uint32_t value) noexcept;
  void refuse(uint32_t abort) noexcept;

  int node_;
  int64_t timeout_ns_;
  int attempts_;
  std::span<const SdoStep> steps_;
  size_t at_ = 0;
  Status status_ = Status::kDone;
  SdoUpload upload_;
  bool reads_ = false;      // the present transfer is an upload
  bool written_ = false;    // the value of a step that is read back
  bool uploading_ = false;  // which has not ended
  int attempt_ = 0;         // of the present transfer; 0: not requested yet
  int64_t requested_ns_ = 0;
  uint32_t failure_ = 0;
  bool value_differs_ = false;
  uint32_t found_ = 0;
};

}  // namespace tendril::hal
