// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <thread>

namespace tendril::rt {

/// Gives the processor away at random moments, so that threads interleave in the middle of their reads and
/// writes even where they share one core. Each thread has its own sequence, fixed by its seed.
class Interruptions {
 public:
  static void seed(uint64_t seed) { state() = seed * 2654435761u + 1; }
  static void maybe() {
    uint64_t& x = state();
    x ^= x << 13;
    x ^= x >> 7;
    x ^= x << 17;
    if (x % 512 == 0) std::this_thread::yield();
  }

 private:
  static uint64_t& state() {
    thread_local uint64_t value = 1;
    return value;
  }
};

/// A value that shows whether it is torn: how many words it has, and each of them, follows from its number;
/// each is written, read and copied one by one with interruptions in between. Lengths differ at random, so
/// that writer and reader get past each other at every place, and what an older, longer value left lies
/// behind.
class TornValue {
 public:
  void write(uint64_t number) noexcept {
    for (std::size_t i = 0; i < length(number); ++i) {
      Interruptions::maybe();
      words_[i] = word(number, i);
    }
  }

  uint64_t number() const noexcept { return words_[0]; }

  bool torn() const noexcept {
    const uint64_t expected = number();
    bool torn = false;
    for (std::size_t i = 0; i < length(expected); ++i) {
      Interruptions::maybe();
      torn |= words_[i] != word(expected, i);
    }
    return torn;
  }

  TornValue() { words_.fill(0); }
  TornValue(const TornValue& other) noexcept { *this = other; }
  TornValue& operator=(const TornValue& other) noexcept {
    for (std::size_t i = 0; i < length(other.number()); ++i) {
      Interruptions::maybe();
      words_[i] = other.words_[i];
    }
    return *this;
  }

 private:
  static constexpr std::size_t kLongest = 48;
  /// 1 to kLongest, as good as drawn for each number (Fibonacci hashing).
  static std::size_t length(uint64_t number) { return 1 + ((number * 0x9E3779B97F4A7C15u) >> 32) % kLongest; }
  static uint64_t word(uint64_t number, std::size_t i) { return number + i * 0x9E3779B97F4A7C15u * number; }
  std::array<uint64_t, kLongest> words_;
};

}  // namespace tendril::rt
