// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>

#include "tests/rt/torn_value.h"

#ifdef __has_feature
#if __has_feature(thread_sanitizer)
#define TENDRIL_UNDER_TSAN
#endif
#endif
#ifdef __SANITIZE_THREAD__
#define TENDRIL_UNDER_TSAN
#endif

namespace tendril::rt {

/// What the reader of a channel of latest values saw.
struct LatestVerdict {
  int64_t newer = 0;         // values that followed an older one, as they should
  int64_t torn = 0;          // parts of two values
  int64_t changed = 0;       // changed while the reader held them
  int64_t older = 0;         // older than one seen before, or announced as fresh and not newer
  bool last_missed = false;  // the last value published did not arrive
};

/// Runs a writer and a reader as fast as they can until `count` values, numbered from 1, are published.
template <class Channel>
LatestVerdict fuzz_latest(uint64_t count, uint64_t seed) {
  const auto channel = std::make_unique<Channel>();
  std::atomic<bool> over{false};
  std::thread writer([&] {
    Interruptions::seed(seed);
    for (uint64_t number = 1; number <= count; ++number) {
      channel->back().write(number);
      channel->publish();
    }
    over.store(true, std::memory_order_release);
  });

  Interruptions::seed(seed + 1);
  LatestVerdict verdict;
  uint64_t last = 0;
  for (bool last_look = false; !last_look;) {
    last_look = over.load(std::memory_order_acquire);
    const bool fresh = channel->fresh();
    const TornValue& value = channel->latest();
    const uint64_t number = value.number();
    verdict.torn += value.torn();
    verdict.changed += value.number() != number;
    verdict.older += number < last || (fresh && number == last);
    verdict.newer += number > last;
    last = number;
  }
  writer.join();
  verdict.last_missed = last != count;
  return verdict;
}

/// What the consumer of a channel of every value saw.
struct EveryVerdict {
  uint64_t received = 0, dropped = 0;
  uint64_t torn = 0;
  uint64_t out_of_order = 0;  // not newer than the value before
};

/// Runs a producer and a consumer as fast as they can until `count` values, numbered from 1, are offered;
/// what is refused is not offered again.
template <class Ring>
EveryVerdict fuzz_every(uint64_t count, uint64_t seed) {
  const auto ring = std::make_unique<Ring>();
  std::atomic<bool> over{false};
  std::thread producer([&] {
    Interruptions::seed(seed);
    TornValue value;
    for (uint64_t number = 1; number <= count; ++number) {
      value.write(number);
      if (!ring->push(value)) std::this_thread::yield();
    }
    over.store(true, std::memory_order_release);
  });

  Interruptions::seed(seed + 1);
  EveryVerdict verdict;
  TornValue value;
  uint64_t last = 0;
  for (bool last_look = false; !last_look;) {
    last_look = over.load(std::memory_order_acquire);
    // The bound is for broken rings, which may hand out values without end.
    while (verdict.received <= count && ring->pop(value)) {
      ++verdict.received;
      verdict.torn += value.torn();
      verdict.out_of_order += value.number() <= last;
      last = value.number();
    }
    std::this_thread::yield();  // spinning on an empty ring starves the producer under ThreadSanitizer
  }
  producer.join();
  verdict.dropped = ring->dropped();
  return verdict;
}

/// Whether a fuzz finds a broken channel out with one of many seeds. With a single one it need not: on a busy
/// machine the writer may be done before the reader has begun.
/// @param fuzz  takes a seed and returns whether what it saw was wrong
template <class Fuzz>
bool finds_out(Fuzz fuzz) {
  constexpr uint64_t kSeeds = 100;
  for (uint64_t seed = 1; seed <= kSeeds; ++seed)
    if (fuzz(seed)) return true;
  return false;
}

}  // namespace tendril::rt
