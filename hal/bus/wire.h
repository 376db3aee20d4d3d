// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendril::hal {

/// How the frames of a protocol travel.
enum class Wire : uint8_t {
  kCan,     ///< as CAN frames; those of more than 8 bytes as CAN FD frames without a second bit rate
  kSerial,  ///< as the bytes of a serial line, 8N1: a frame holds a whole packet, its identifier is not sent
};

/// Bits that a frame keeps the wire busy for at most.
///
/// Classic CAN, n bytes: g + 8n + 13 + ⌊(g + 8n − 1)/4⌋ with g = 34, or 54 for extended identifiers: 55 for 0
/// bytes, 115 for 6, 135 for 8, the 3 bits between frames included. [Davis, Burns, Bril, Lukkien 2007,
/// "Controller Area Network (CAN) schedulability analysis", eqs. 1-3] CAN FD: h + 8n + ⌊(h + 8n − 1)/4⌋ with
/// h = 22 or 41, n rounded up to a length that FD frames have; then stuff count, CRC and their fixed stuff
/// bits, 27 up to 16 bytes and 32 above; then 13. [ISO 11898-1:2015, FD frames] Serial: 10 for each byte.
/// @param length  n, bytes of data, 0..kMaxFrameBytes
/// Real-time: yes.
int worst_case_bits(Wire wire, int length, bool extended = false) noexcept;

}  // namespace tendril::hal
