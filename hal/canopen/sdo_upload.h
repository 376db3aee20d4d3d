// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "hal/bus/frame_batch.h"
#include "hal/canopen/sdo.h"

namespace tendril::hal {

/// An SDO client that reads one object of any length from a drive, in segments if it is long. No function
/// waits. [CiA 301, SDO upload]
///
/// A transfer that is not answered in time is aborted and repeated. An object longer than the buffer is cut.
class SdoUpload {
 public:
  enum class Status : uint8_t { kRunning, kDone, kFailed };
  static constexpr int kCapacity = 64;  // bytes

  /// @param node        the drive, 1..127
  /// @param timeout_ns  for each answer
  /// @param attempts    to read the whole object, at least 1
  SdoUpload(int node, int64_t timeout_ns, int attempts) noexcept
      : node_(node), timeout_ns_(timeout_ns), attempts_(attempts) {}

  /// Begins to read an object; the text of the last one is dropped. Real-time: yes.
  void start(ObjectAddress object) noexcept;

  /// Processes an answer of the drive; one that belongs to no open request is ignored. Real-time: yes.
  void receive(const SdoAnswer& answer) noexcept;

  /// Sends the next request or abort if one is due: at most one frame. Real-time: yes (bounded, no
  /// allocation).
  Status advance(int64_t now_ns, FrameBatch& out) noexcept;

  /// kFailed: the abort code, SdoAbort::kTimeout where no answer came. Real-time: yes.
  uint32_t failure() const noexcept { return failure_; }

  /// kDone: the bytes that were read. Valid until `start`. Real-time: yes.
  std::string_view text() const noexcept { return {text_.data(), static_cast<size_t>(size_)}; }

 private:
  void begin() noexcept;
  void append(const uint8_t* bytes, int count) noexcept;
  void take_segment(const SdoAnswer& answer) noexcept;
  void end(Status status, uint32_t failure) noexcept;

  int node_;
  int64_t timeout_ns_;
  int attempts_;
  ObjectAddress object_;
  Status status_ = Status::kDone;
  int attempt_ = 0;
  bool awaits_answer_ = false;
  bool in_segments_ = false;
  bool toggle_ = false;  // of the segment that is due
  uint32_t abort_ = 0;   // to be sent; 0: none
  int64_t requested_ns_ = 0;
  uint32_t failure_ = 0;
  std::array<char, kCapacity> text_{};
  int size_ = 0;
};

}  // namespace tendril::hal
