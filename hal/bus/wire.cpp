// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/wire.h"

#include <algorithm>
#include <array>

namespace tendril::hal {
namespace {

constexpr std::array kFdLengths{12, 16, 20, 24, 32, 48, 64};
constexpr int kTrailer = 13;  // CRC delimiter, acknowledgement, end of frame, pause

/// Bits with the most stuff bits they can need: one after every four.
int stuffed(int bits) noexcept { return bits + (bits - 1) / 4; }

int can_bits(int length, bool extended) noexcept {
  return stuffed((extended ? 54 : 34) + 8 * length) + kTrailer;
}

int can_fd_bits(int length, bool extended) noexcept {
  const int padded = *std::lower_bound(kFdLengths.begin(), kFdLengths.end() - 1, length);
  return stuffed((extended ? 41 : 22) + 8 * padded) + (padded <= 16 ? 27 : 32) + kTrailer;
}

}  // namespace

int worst_case_bits(Wire wire, int length, bool extended) noexcept {
  if (wire == Wire::kSerial) return 10 * length;
  return length <= 8 ? can_bits(length, extended) : can_fd_bits(length, extended);
}

}  // namespace tendril::hal
