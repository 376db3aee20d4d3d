// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace tendril::hal {

/// The physical quantity of a number in a robot file, with its SI unit.
enum class Dimension {
  kNumber,        // 1
  kLength,        // m
  kTime,          // s
  kRate,          // Hz
  kBitRate,       // bit/s
  kInverseTime,   // 1/s
  kMass,          // kg
  kForce,         // N
  kPressure,      // Pa
  kSpeed,         // m/s
  kAcceleration,  // m/s²
  kJerk,          // m/s³
  kAngle,         // rad
  kVolume,        // m³
  kFlow,          // m³/s
  kTurnRate,      // rev/s
  kCurrent,       // A
  kTorque,        // Nm
};

/// Bounds of a number in its SI unit. A bound that is not named does not bind.
struct Range {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double above = -kInfinity, at_least = -kInfinity, at_most = kInfinity, below = kInfinity;
};
inline constexpr Range kPositive = {.above = 0}, kNotNegative = {.at_least = 0};

/// One section of a robot file, from which a drive protocol reads its own keys. The reader of robot files
/// implements it. A mistake throws an error that names file, line and key. Real-time: no, for all of it.
class Settings {
 public:
  enum class Need : uint8_t { kRequired, kOptional };

  virtual ~Settings() = default;

  /// Reads one key. Without the key `out` keeps its value; a required key is then reported as missing.
  virtual void number(std::string_view key, double& out, Dimension dimension, const Range& range = {},
                      Need need = Need::kOptional) = 0;
  virtual void whole(std::string_view key, int& out, const Range& range = {},
                     Need need = Need::kOptional) = 0;
  virtual void flag(std::string_view key, bool& out) = 0;
  /// One of several words. @param index  of the word in the file
  virtual void word(std::string_view key, int& index, std::span<const std::string_view> words) = 0;
  /// A section within this one.
  virtual void section(std::string_view key, const std::function<void(Settings&)>& read) = 0;

  /// Refuses a key with a reason that says more than "unknown key".
  virtual void refuse(std::string_view key, std::string_view reason) = 0;
  /// Whether the file has the key.
  virtual bool has(std::string_view key) const = 0;
  /// Reports a mistake: "found VALUE, expected EXPECTED".
  [[noreturn]] virtual void fail(std::string_view key, std::string_view expected) const = 0;

  /// A time, kept in ns.
  void time(std::string_view key, int64_t& time_ns, const Range& range) {
    double seconds = 1e-9 * static_cast<double>(time_ns);
    number(key, seconds, Dimension::kTime, range);
    time_ns = std::llround(1e9 * seconds);
  }

  /// One of several words, each with its value.
  template <class T>
  void word(std::string_view key, T& out, std::initializer_list<std::pair<std::string_view, T>> words) {
    std::vector<std::string_view> names;
    for (const auto& [name, value] : words) names.push_back(name);
    int index = -1;
    word(key, index, names);
    if (index >= 0) out = (words.begin() + index)->second;
  }
};

}  // namespace tendril::hal
