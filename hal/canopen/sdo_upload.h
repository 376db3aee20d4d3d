#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "hal/bus/frame_batch.h"
#include "hal/canopen/sdo.h"

namespace tendril::hal {

/// Reads one object of any length from a drive, in segments, without ever waiting. [CiA 301, SDO upload]
///
/// Where an answer does not come in time the transfer is aborted and begun anew. What is longer than the
/// buffer is cut, and the rest of it not asked for.
class SdoUpload {
 public:
  enum class Status : uint8_t { kRunning, kDone, kFailed };
  static constexpr int kCapacity = 64;  // bytes

  /// @param node        the drive, 1..127
  /// @param timeout_ns  for each answer
  /// @param attempts    to read the whole object, at least 1
  SdoUpload(int node, int64_t timeout_ns, int attempts) noexcept
      : node_(node), timeout_ns_(timeout_ns), attempts_(attempts) {}

  /// Begins to read an object; what was read before is forgotten. Real-time: yes.
  void start(ObjectAddress object) noexcept;

  /// Takes in an answer of the drive; one that fits no open question is ignored. Real-time: yes.
  void receive(const SdoAnswer& answer) noexcept;

  /// Sends the next request or abort if one is due: at most one frame. Real-time: yes (bounded, no
  /// allocation).
  Status advance(int64_t now_ns, FrameBatch& out) noexcept;

  /// kFailed: the abort code, SdoAbort::kTimeout where no answer came. Real-time: yes.
  uint32_t failure() const noexcept { return failure_; }

  /// kDone: what was read. Valid until `start`. Real-time: yes.
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
  bool asked_ = false;  // an answer is due
  bool in_segments_ = false;
  bool toggle_ = false;  // of the segment that is due
  uint32_t abort_ = 0;   // to be sent; 0: none
  int64_t asked_ns_ = 0;
  uint32_t failure_ = 0;
  std::array<char, kCapacity> text_{};
  int size_ = 0;
};

}  // namespace tendril::hal
