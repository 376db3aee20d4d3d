// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "hal/bus/frame.h"

namespace tendril::hal {

/// Which way the bits of a signal run through the bytes of a frame.
enum class ByteOrder : uint8_t {
  kIntel,    // the start bit is the least significant one, later bytes weigh more
  kMotorola  // the start bit is the most significant one, later bytes weigh less
};

/// How the bits of a signal encode a number.
enum class SignalType : uint8_t { kUnsigned, kSigned, kFloat };

/// A number in a frame, as a DBC file describes it: value = scale · number + offset.
struct Signal {
  std::string name;  // an identifier as in C
  int start = 0;     // bit 8 · byte + bit, bit 7 is a byte's most significant one
  int length = 0;    // bits, 1..64; kFloat: 32 or 64
  ByteOrder order = ByteOrder::kIntel;
  SignalType type = SignalType::kUnsigned;
  double scale = 1;   // unit per count, not 0
  double offset = 0;  // unit
  std::string unit{};
};

/// Bytes that a frame must have for the signal; more than 8 where no classic frame has room.
/// @param signal  with start and length not negative
/// Real-time: yes.
int bytes_needed(const Signal& signal) noexcept;

/// The bits of a frame that belong to the signal: byte by byte from the least significant on.
/// @param signal  one that passes `check`
/// Real-time: yes.
uint64_t bits_of(const Signal& signal) noexcept;

/// Checks a signal: name, that it lies within 8 bytes, length, scale, offset.
/// @throws std::invalid_argument with a sentence that names the signal and what is expected
/// Real-time: no.
void check(const Signal& signal);

/// Reads a signal.
/// @param signal  one that passes `check`
/// @param frame   any; its identifier is not checked
/// @return        the value in the signal's unit, rounded to a double; nothing where the frame is too short
///                or a float in it is not finite
/// Real-time: yes.
std::optional<double> decode(const Signal& signal, const Frame& frame) noexcept;

/// Writes a signal, rounded to its nearest count, and leaves all other bits of the frame as they are.
/// @param signal  one that passes `check`
/// @param frame   long enough for it
/// @return        false, with nothing written, where the value is not finite or does not fit, or the frame is
///                too short
/// Real-time: yes.
bool encode(const Signal& signal, double value, Frame& frame) noexcept;

}  // namespace tendril::hal
