// SPDX-License-Identifier: Apache-2.0
#include "hal/sensor/signal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace tendril::hal {
namespace {

/// Bits before the signal, counted from the most significant bit of the first byte on, as Motorola's run.
int bits_before(const Signal& signal) noexcept { return signal.start / 8 * 8 + 7 - signal.start % 8; }

/// All 64 bits of a frame as one number, in which the bits of the signal are contiguous.
uint64_t load(const Frame& frame, ByteOrder order) noexcept {
  uint64_t bits = 0;
  for (int i = 0; i < 8; ++i) bits = bits << 8 | frame.data[order == ByteOrder::kIntel ? 7 - i : i];
  return bits;
}

void store(Frame& frame, ByteOrder order, uint64_t bits) noexcept {
  for (int i = 0; i < 8; ++i)
    frame.data[order == ByteOrder::kIntel ? i : 7 - i] = static_cast<uint8_t>(bits >> (8 * i));
}

/// Where the least significant bit of the signal lies in what `load` gives.
int shift_of(const Signal& signal) noexcept {
  return signal.order == ByteOrder::kIntel ? signal.start : 64 - bits_before(signal) - signal.length;
}

uint64_t mask_of(int length) noexcept { return ~uint64_t{0} >> (64 - length); }

double number_of(const Signal& signal, uint64_t bits) noexcept {
  switch (signal.type) {
    case SignalType::kUnsigned:
      return static_cast<double>(bits);
    case SignalType::kSigned: {
      const int unused = 64 - signal.length;
      return static_cast<double>(static_cast<int64_t>(bits << unused) >> unused);
    }
    case SignalType::kFloat:
      break;
  }
  return signal.length == 64 ? std::bit_cast<double>(bits)
                             : static_cast<double>(std::bit_cast<float>(static_cast<uint32_t>(bits)));
}

/// The bits of a number, which for integers is a whole one. @return nothing where it does not fit
std::optional<uint64_t> bits_of_number(const Signal& signal, double number) noexcept {
  if (signal.type == SignalType::kFloat) {
    if (signal.length == 64) return std::bit_cast<uint64_t>(number);
    if (std::abs(number) > std::numeric_limits<float>::max()) return std::nullopt;
    return std::bit_cast<uint32_t>(static_cast<float>(number));
  }
  const bool is_signed = signal.type == SignalType::kSigned;
  const double end = std::ldexp(1.0, is_signed ? signal.length - 1 : signal.length);
  if (number >= end || number < (is_signed ? -end : 0)) return std::nullopt;
  return is_signed ? static_cast<uint64_t>(static_cast<int64_t>(number)) : static_cast<uint64_t>(number);
}

bool is_identifier(const std::string& name) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  if (name.empty() || !is_letter(name[0])) return false;
  return std::all_of(name.begin(), name.end(),
                     [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); });
}

}  // namespace

int bytes_needed(const Signal& signal) noexcept {
  const int before = signal.order == ByteOrder::kIntel ? signal.start : bits_before(signal);
  return (before + signal.length + 7) / 8;
}

uint64_t bits_of(const Signal& signal) noexcept {
  Frame frame;
  store(frame, signal.order, mask_of(signal.length) << shift_of(signal));
  return load(frame, ByteOrder::kIntel);
}

void check(const Signal& signal) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument("signal '" + signal.name + "': " + what);
  };
  if (!is_identifier(signal.name))
    refuse("the name must be of letters, digits and _, and not begin with a digit");
  if (signal.start < 0 || signal.start > 63)
    refuse("the start bit " + std::to_string(signal.start) + " is not within 0..63");
  if (signal.length < 1 || signal.length > 64)
    refuse("the length " + std::to_string(signal.length) + " is not within 1..64 bits");
  if (signal.type == SignalType::kFloat && signal.length != 32 && signal.length != 64)
    refuse("a float must be of 32 or 64 bits, not " + std::to_string(signal.length));
  if (bytes_needed(signal) > 8)
    refuse(std::to_string(signal.length) + " bits from bit " + std::to_string(signal.start) +
           " on reach beyond the 8 bytes of a frame");
  if (!std::isfinite(signal.scale) || signal.scale == 0) refuse("the scale must be a number other than 0");
  if (!std::isfinite(signal.offset)) refuse("the offset must be a number");
}

std::optional<double> decode(const Signal& signal, const Frame& frame) noexcept {
  if (frame.length < bytes_needed(signal)) return std::nullopt;
  const uint64_t bits = load(frame, signal.order) >> shift_of(signal) & mask_of(signal.length);
  const double value = signal.scale * number_of(signal, bits) + signal.offset;
  if (!std::isfinite(value)) return std::nullopt;
  return value;
}

bool encode(const Signal& signal, double value, Frame& frame) noexcept {
  double number = (value - signal.offset) / signal.scale;
  if (!std::isfinite(number) || frame.length < bytes_needed(signal)) return false;
  if (signal.type != SignalType::kFloat) number = std::round(number);
  const auto bits = bits_of_number(signal, number);
  if (!bits) return false;
  const int shift = shift_of(signal);
  const uint64_t mask = mask_of(signal.length) << shift;
  store(frame, signal.order, (load(frame, signal.order) & ~mask) | (*bits << shift & mask));
  return true;
}

}  // namespace tendril::hal
