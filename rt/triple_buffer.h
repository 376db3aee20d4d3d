// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "rt/cache_line.h"

namespace tendril::rt {

/// Hands the latest value from one writer thread to one reader thread; neither ever waits for the other.
///
/// There are three slots. The writer owns one (back), the reader owns one (front), and the third (middle)
/// belongs to whoever swaps it next against their own. One atomic byte holds the index of the middle slot and
/// a bit that says whether it is fresh, that is, published and not yet taken. A swap is a single exchange of
/// that byte, so a slot always has exactly one owner and no value is ever copied, moved or torn. Values that
/// the reader was too slow for are overwritten: for a channel that loses nothing see SpscRing.
///
/// T may be large and need not be copyable. Slots are reused: a T that owns memory keeps it from value to
/// value.
template <class T>
class TripleBuffer {
 public:
  /// Starts without a value; the three slots are value-initialised.
  TripleBuffer() = default;

  TripleBuffer(const TripleBuffer&) = delete;
  TripleBuffer& operator=(const TripleBuffer&) = delete;

  /// The slot that the writer may fill; the same one until publish().
  /// It holds what was published some time ago, or nothing yet: write every field.
  /// Real-time: wait-free, one writer thread.
  T& back() noexcept { return slots_[back_].value; }

  /// Makes what is in back() the latest value; references from back() must not be used after it.
  /// Real-time: wait-free, one writer thread.
  void publish() noexcept {
    // Release: whoever takes this slot sees all that was written into it. Acquire: the slot that comes back
    // may be the one the reader just gave away, and what it read there must happen before we write over it.
    const uint8_t given = static_cast<uint8_t>(back_ | kFresh);
    back_ = middle_.exchange(given, std::memory_order_acq_rel) & kIndex;
  }

  /// The newest published value, or a value-initialised T where nothing was published yet.
  /// @return  a reference to the reader's own slot; it does not change before the next call of latest()
  /// Real-time: wait-free, one reader thread.
  const T& latest() noexcept {
    if (fresh()) {
      // Acquire: what the writer wrote before its release is visible. Release: our reads of the slot that we
      // give away happen before the writer, which acquires it, writes there.
      front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
      has_value_ = true;
    }
    return slots_[front_].value;
  }

  /// Whether latest() would return a newer value than the one that the reader holds.
  /// Real-time: wait-free, one reader thread.
  bool fresh() const noexcept {
    // Relaxed: nothing is read on the strength of this load alone. Only the reader clears the bit, so once it
    // is seen, the exchange in latest() finds it too, perhaps with a newer slot.
    return (middle_.load(std::memory_order_relaxed) & kFresh) != 0;
  }

  /// Whether latest() returns something that was published.
  /// Real-time: wait-free, one reader thread.
  bool has_value() const noexcept { return has_value_ || fresh(); }

 private:
  static constexpr uint8_t kIndex = 0b011;
  static constexpr uint8_t kFresh = 0b100;
  static_assert(std::atomic<uint8_t>::is_always_lock_free);

  struct alignas(kCacheLine) alignas(T) Slot {
    T value{};
  };

  std::array<Slot, 3> slots_;
  alignas(kCacheLine) std::atomic<uint8_t> middle_{1};
  alignas(kCacheLine) uint8_t back_ = 0;   // the writer's
  alignas(kCacheLine) uint8_t front_ = 2;  // the reader's
  bool has_value_ = false;                 // the reader's
};

}  // namespace tendril::rt
