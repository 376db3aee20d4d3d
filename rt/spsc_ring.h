// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt/cache_line.h"

namespace tendril::rt {

/// Hands every value, in order, from one producer thread to one consumer thread; neither ever waits for the
/// other.
///
/// Each side owns one counter, which only grows: tail_ of what was pushed, head_ of what was popped. Each
/// keeps the last value it saw of the other's and looks again only when that says full (or empty), so that
/// the cache line of the other side is touched once in a while and not for each value.
///
/// What does not fit is dropped and counted: the control thread must not wait for a logger.
template <class T, std::size_t Capacity>
class SpscRing {
  static_assert(std::has_single_bit(Capacity), "Capacity must be a power of two");
  static_assert(std::is_nothrow_copy_assignable_v<T>, "a copy that throws or allocates has no place here");
  static_assert(std::atomic<uint64_t>::is_always_lock_free);

 public:
  SpscRing() = default;
  SpscRing(const SpscRing&) = delete;
  SpscRing& operator=(const SpscRing&) = delete;

  /// Appends a copy of the value.
  /// @return  false where the ring is full: the value is not stored, and counted in dropped()
  /// Real-time: wait-free (one copy of T), one producer thread.
  bool push(const T& value) noexcept {
    // Relaxed: this thread is the only one that writes tail_.
    const uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_seen_ == Capacity) {
      // Acquire, with the release in pop(): the consumer has copied the slot out before we write over it.
      head_seen_ = head_.load(std::memory_order_acquire);
      if (tail - head_seen_ == Capacity) {
        // A load and a store and no fetch_add: there is one writer, and x86 then needs no locked instruction.
        dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
        return false;
      }
    }
    slots_[tail & kMask] = value;
    // Release: whoever sees the new tail sees the slot.
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  /// Takes the oldest value.
  /// @param[out] value  left as it is where the ring is empty
  /// @return  false where the ring is empty
  /// Real-time: wait-free (one copy of T), one consumer thread.
  bool pop(T& value) noexcept {
    // Relaxed: this thread is the only one that writes head_.
    const uint64_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_seen_) {
      // Acquire, with the release in push(): the slot is complete before we read it.
      tail_seen_ = tail_.load(std::memory_order_acquire);
      if (head == tail_seen_) return false;
    }
    value = slots_[head & kMask];
    // Release: our read of the slot happens before the producer may use it again.
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// How many values push() has refused so far.
  /// Real-time: wait-free, any thread.
  uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

  /// How many values fit.
  static constexpr std::size_t capacity() noexcept { return Capacity; }

 private:
  static constexpr uint64_t kMask = Capacity - 1;

  // 64 bits do not wrap: at a million values a second they last half a million years.
  alignas(kCacheLine) std::atomic<uint64_t> tail_{0};  // this line is the producer's
  uint64_t head_seen_ = 0;
  std::atomic<uint64_t> dropped_{0};
  alignas(kCacheLine) std::atomic<uint64_t> head_{0};  // this line is the consumer's
  uint64_t tail_seen_ = 0;
  alignas(kCacheLine) std::array<T, Capacity> slots_{};
};

}  // namespace tendril::rt
