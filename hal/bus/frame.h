// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tendril::hal {

/// Bytes of data in the longest frame: that of CAN FD, and enough for a packet on a serial line.
inline constexpr int kMaxFrameBytes = 64;

/// What a bus carries at once: a CAN frame, of data as a rule, or a packet of another bus. Classic CAN takes
/// up to 8 bytes. Error frames never leave the bus that received them.
struct Frame {
  uint32_t id = 0;        // 11 bits, or 29 bits where `extended`
  bool extended = false;  // identifier format
  bool remote = false;    // asks for a frame of that identifier, and has no data: its length is 0
  uint8_t length = 0;     // bytes of data, 0..kMaxFrameBytes
  std::array<uint8_t, kMaxFrameBytes> data{};
  int64_t stamp_ns = 0;  // received ones: arrival at this node, CLOCK_MONOTONIC or a virtual bus's clock
};

/// Set in an identifier of 29 bits where it stands for both itself and its format, as in DBC files and in
/// struct can_frame: 0x123 is not 0x80000123.
inline constexpr uint32_t kExtendedMark = 0x8000'0000;

/// An identifier that tells its format. Real-time: yes.
constexpr uint32_t marked_id(uint32_t id, bool extended) noexcept {
  return extended ? id | kExtendedMark : id;
}

/// True where both would look the same on the wire: bytes past `length` and stamps do not count.
/// Real-time: yes.
inline bool operator==(const Frame& a, const Frame& b) noexcept {
  return a.id == b.id && a.extended == b.extended && a.remote == b.remote && a.length == b.length &&
         std::equal(a.data.begin(), a.data.begin() + std::min<int>(a.length, kMaxFrameBytes), b.data.begin());
}

/// The frame in the notation of cansend and `candump -l`: "202#0F0010270000", "049#R" for a remote one, and
/// "202##0" with more than 8 bytes after it.
/// Real-time: no (allocates).
std::string to_text(const Frame& frame);

/// Reads the notation of `to_text`, for frames of up to 8 bytes: 3 hexadecimal digits of identifier, or 8 for
/// an extended one, '#', the bytes or R.
/// @return nothing where the text is no such frame
/// Real-time: yes.
std::optional<Frame> parse_frame(std::string_view text) noexcept;

}  // namespace tendril::hal
