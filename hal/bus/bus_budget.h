// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "hal/bus/wire.h"

namespace tendril::hal {

/// Frames of one length that come again and again.
struct PeriodicFrames {
  int length = 0;         // bytes of data, 0..kMaxFrameBytes
  double rate_hz = 0;     // of each
  int count = 1;          // different identifiers of that kind
  bool extended = false;  // 29-bit identifiers
};

/// Share of the bus that those frames need at worst, 1 for a bus that is always busy.
/// @param bitrate  bit/s, > 0
/// Real-time: yes.
double bus_load(Wire wire, std::span<const PeriodicFrames> traffic, double bitrate) noexcept;

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
BusBudget judge_bus(Wire wire, std::span<const PeriodicFrames> traffic, double bitrate);

}  // namespace tendril::hal
