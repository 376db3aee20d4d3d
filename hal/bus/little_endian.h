// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "hal/bus/frame.h"

namespace tendril::hal {

/// Writes an integer at byte `at` of a frame, least significant byte first. Real-time: yes.
template <typename T>
void put(std::array<uint8_t, kMaxFrameBytes>& data, int at, T value) noexcept {
  const auto bits = static_cast<std::make_unsigned_t<T>>(value);
  for (int i = 0; i < static_cast<int>(sizeof(T)); ++i) data[at + i] = static_cast<uint8_t>(bits >> (8 * i));
}

/// Reads an integer at byte `at` of a frame, least significant byte first. Real-time: yes.
template <typename T>
T get(const std::array<uint8_t, kMaxFrameBytes>& data, int at) noexcept {
  std::make_unsigned_t<T> bits = 0;
  for (int i = 0; i < static_cast<int>(sizeof(T)); ++i)
    bits = static_cast<std::make_unsigned_t<T>>(bits | (static_cast<uint64_t>(data[at + i]) << (8 * i)));
  return static_cast<T>(bits);
}

}  // namespace tendril::hal
