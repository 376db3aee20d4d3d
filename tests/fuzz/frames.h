// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "hal/bus/frame.h"
#include "tests/fuzz/bytes.h"

namespace tendril::fuzz {

/// Makes a frame of an input: what it is, its length, its identifier, its data.
/// @param ids  those that the input can name by a number
inline hal::Frame frame_from(Bytes& bytes, std::span<const uint32_t> ids) {
  const uint8_t form = bytes.byte();
  hal::Frame frame;
  frame.remote = (form & 0xF0) == 0xF0;
  frame.extended = (form & 0xF0) == 0xE0;
  frame.length = frame.remote ? uint8_t{0} : static_cast<uint8_t>(form & 0x0F);
  const uint8_t which = bytes.byte();
  frame.id = which < 0xF0 ? ids[which % ids.size()] : bytes.word() & uint32_t{0x7FF};
  const std::string_view data = bytes.take(frame.length);
  std::copy(data.begin(), data.end(), frame.data.begin());
  return frame;
}

}  // namespace tendril::fuzz
