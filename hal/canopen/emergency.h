// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "hal/bus/frame.h"

namespace tendril::hal {

/// The content of an EMCY frame: an error has appeared, or with code 0 the last one is gone. [CiA 301]
struct Emergency {
  uint16_t code = 0;
  uint8_t error_register = 0;       // object 1001
  std::array<uint8_t, 5> detail{};  // manufacturer-specific
};

/// The EMCY frame of `node`. Real-time: yes.
Frame encode_emergency(int node, const Emergency& emergency) noexcept;

/// Reads an EMCY frame; one may leave out manufacturer-specific bytes. @return nothing where the frame is
/// none of `node`. Real-time: yes.
std::optional<Emergency> decode_emergency(const Frame& frame, int node) noexcept;

/// An EMCY error code in words, or its class where it is none of the usual ones [CiA 301, table of emergency
/// error codes; CiA 402 for 0x2000-0x8FFF]. Real-time: yes.
const char* describe_emergency(uint16_t code) noexcept;

}  // namespace tendril::hal
