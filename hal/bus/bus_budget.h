#pragma once

#include <span>
#include <string>

namespace tendril::hal {

/// Frames of one length that come again and again.
struct PeriodicFrames {
  int length = 0;         // bytes of data, 0..8
  double rate_hz = 0;     // of each
  int count = 1;          // different identifiers of that kind
  bool extended = false;  // 29-bit identifiers
};

/// Bits of a frame on the wire with the most stuff bits it can need, and the 3 bits between frames: g + 8n +
/// 13 + ⌊(g + 8n − 1)/4⌋ with g = 34, or 54 for extended identifiers.
/// @param length  n, bytes of data, 0..8
/// @return        55 for 0 bytes, 115 for 6, 135 for 8
/// [Davis, Burns, Bril, Lukkien 2007, "Controller Area Network (CAN) schedulability analysis", eqs. 1-3]
/// Real-time: yes.
int worst_case_bits(int length, bool extended = false) noexcept;

/// Share of the bus that those frames need at worst, 1 for a bus that is always busy.
/// @param bitrate  bit/s, > 0
/// Real-time: yes.
double bus_load(std::span<const PeriodicFrames> traffic, double bitrate) noexcept;

/// What a configuration asks of the bus, judged before anything is sent.
struct BusBudget {
  enum class Verdict { kFits, kTight, kExceeds };
  double load = 0;
  Verdict verdict = Verdict::kFits;
  std::string text;  // "the bus is busy 59 % of the time at worst"; says what to change unless it fits
};

/// Above this share SYNC and emergencies wait long enough to be felt: a warning.
inline constexpr double kTightLoad = 0.7;

/// Judges a load: kTight above kTightLoad, kExceeds above 1, which no configuration may have.
/// Real-time: no (allocates).
BusBudget judge_bus(std::span<const PeriodicFrames> traffic, double bitrate);

}  // namespace tendril::hal
