// SPDX-License-Identifier: Apache-2.0
// x86 orders memory so strictly that a missing acquire or release rarely shows in a run. ThreadSanitizer
// follows the rules of the language instead, whatever the processor: it must find each twin below, which
// differs from the real channel in one memory order, and nothing in the twin that has them all.
#include <catch2/catch.hpp>

#include "tests/rt/channel_fuzz.h"
#include "tests/rt/child_process.h"

#ifdef TENDRIL_UNDER_TSAN

namespace {
bool race_ends_process = false;
}

// ThreadSanitizer calls this, where a program defines it, for every race it reports.
extern "C" void __tsan_on_report(void*);
extern "C" void __tsan_on_report(void*) {
  if (race_ends_process) _exit(tendril::rt::kChildRaced);
}

using namespace tendril::rt;

namespace {

template <std::memory_order kPublish, std::memory_order kTake>
class TripleBufferTwin {
 public:
  TornValue& back() { return slots_[back_]; }
  void publish() { back_ = middle_.exchange(back_ | 4u, kPublish) & 3u; }
  bool fresh() const { return (middle_.load(std::memory_order_relaxed) & 4u) != 0; }
  const TornValue& latest() {
    if (fresh()) front_ = middle_.exchange(front_, kTake) & 3u;
    return slots_[front_];
  }

 private:
  std::array<TornValue, 3> slots_;
  std::atomic<unsigned> middle_{1};
  unsigned back_ = 0, front_ = 2;
};

template <std::memory_order kStoreTail, std::memory_order kLoadTail, std::memory_order kStoreHead,
          std::memory_order kLoadHead>
class RingTwin {
 public:
  bool push(const TornValue& value) {
    const uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(kLoadHead) == slots_.size()) return false;
    slots_[tail % slots_.size()] = value;
    tail_.store(tail + 1, kStoreTail);
    return true;
  }
  bool pop(TornValue& value) {
    const uint64_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(kLoadTail)) return false;
    value = slots_[head % slots_.size()];
    head_.store(head + 1, kStoreHead);
    return true;
  }
  uint64_t dropped() const { return 0; }

 private:
  std::array<TornValue, 4> slots_;
  std::atomic<uint64_t> head_{0}, tail_{0};
};

template <class Fuzz>
bool races(Fuzz fuzz) {
  return child_raced([&] {
    race_ends_process = true;
    return fuzz();
  });
}

// Every count of a verdict is looked at: the compiler leaves out reads whose results nobody uses, and what is
// not read does not race.
template <std::memory_order kPublish, std::memory_order kTake>
bool triple_buffer_races(uint64_t seed = 1) {
  return races([seed] {
    const LatestVerdict verdict = fuzz_latest<TripleBufferTwin<kPublish, kTake>>(20'000, seed);
    return verdict.newer > 0 && verdict.torn + verdict.changed + verdict.older == 0 && !verdict.last_missed;
  });
}

template <std::memory_order kStoreTail, std::memory_order kLoadTail, std::memory_order kStoreHead,
          std::memory_order kLoadHead>
bool ring_races(uint64_t seed = 1) {
  return races([seed] {
    const auto verdict = fuzz_every<RingTwin<kStoreTail, kLoadTail, kStoreHead, kLoadHead>>(20'000, seed);
    return verdict.received > 0 && verdict.torn + verdict.out_of_order == 0;
  });
}

constexpr auto kRelaxed = std::memory_order_relaxed;
constexpr auto kAcquire = std::memory_order_acquire;
constexpr auto kRelease = std::memory_order_release;
constexpr auto kBoth = std::memory_order_acq_rel;

}  // namespace

TEST_CASE("TripleBuffer needs acquire and release on both sides", "[rt]") {
  CHECK_FALSE(triple_buffer_races<kBoth, kBoth>());
  CHECK(finds_out(triple_buffer_races<kAcquire, kBoth>));
  CHECK(finds_out(triple_buffer_races<kRelease, kBoth>));
  CHECK(finds_out(triple_buffer_races<kBoth, kAcquire>));
  CHECK(finds_out(triple_buffer_races<kBoth, kRelease>));
}

TEST_CASE("SpscRing needs each of its two acquires and two releases", "[rt]") {
  CHECK_FALSE(ring_races<kRelease, kAcquire, kRelease, kAcquire>());
  CHECK(finds_out(ring_races<kRelaxed, kAcquire, kRelease, kAcquire>));
  CHECK(finds_out(ring_races<kRelease, kRelaxed, kRelease, kAcquire>));
  CHECK(finds_out(ring_races<kRelease, kAcquire, kRelaxed, kAcquire>));
  CHECK(finds_out(ring_races<kRelease, kAcquire, kRelease, kRelaxed>));
}

#endif
