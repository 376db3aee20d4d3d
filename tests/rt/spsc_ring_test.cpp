// SPDX-License-Identifier: Apache-2.0
#include "rt/spsc_ring.h"

#include <catch2/catch.hpp>
#include <deque>
#include <memory>
#include <random>

#include "tests/rt/channel_fuzz.h"

namespace tendril::rt::spsc_ring_test {

constexpr std::size_t kCapacity = 4;  // small, so that full and empty are everyday events

// Broken on purpose: the slot counts as full before the value is in it.
class AnnouncesBeforeWriting {
 public:
  bool push(const TornValue& value) noexcept {
    const uint64_t tail = tail_.load();
    if (tail - head_.load() == kCapacity) return ++dropped_, false;
    tail_.store(tail + 1);
    slots_[tail % kCapacity] = value;
    return true;
  }
  bool pop(TornValue& value) noexcept {
    const uint64_t head = head_.load();
    if (head == tail_.load()) return false;
    value = slots_[head % kCapacity];
    head_.store(head + 1);
    return true;
  }
  uint64_t dropped() const { return dropped_; }

 private:
  std::array<TornValue, kCapacity> slots_;
  std::atomic<uint64_t> head_{0}, tail_{0};
  uint64_t dropped_ = 0;
};

// Broken on purpose: never looks whether it is full.
class Overwrites {
 public:
  bool push(const TornValue& value) noexcept {
    slots_[tail_.load() % kCapacity] = value;
    ++tail_;
    return true;
  }
  bool pop(TornValue& value) noexcept {
    if (head_ == tail_.load()) return false;
    value = slots_[head_++ % kCapacity];
    return true;
  }
  uint64_t dropped() const { return 0; }

 private:
  std::array<TornValue, kCapacity> slots_;
  std::atomic<uint64_t> tail_{0};
  uint64_t head_ = 0;
};

TEST_CASE("SpscRing delivers every value once, whole and in order, or counts it as dropped", "[rt]") {
  const auto seed = GENERATE(1u, 2u, 3u, 4u);
  CAPTURE(seed);
  const uint64_t count = 50'000;
  const EveryVerdict verdict = fuzz_every<SpscRing<TornValue, kCapacity>>(count, seed);
  CHECK(verdict.torn == 0);
  CHECK(verdict.out_of_order == 0);
  CHECK(verdict.received > 0);
  CHECK(verdict.received + verdict.dropped == count);
}

#ifndef TENDRIL_UNDER_TSAN  // the twins race on purpose, for their own kinds under TSan see
                            // memory_order_test.cpp
TEST_CASE("The fuzz of SpscRing catches a ring that announces a value before it is there", "[rt]") {
  CHECK(finds_out([](auto seed) {
    const EveryVerdict verdict = fuzz_every<AnnouncesBeforeWriting>(20'000, seed);
    return verdict.torn + verdict.out_of_order > 0;
  }));
}

TEST_CASE("The fuzz of SpscRing catches a ring that overwrites what was not read", "[rt]") {
  CHECK(finds_out([](auto seed) { return fuzz_every<Overwrites>(20'000, seed).out_of_order > 0; }));
}
#endif

TEST_CASE("SpscRing behaves as a queue of its capacity", "[unit]") {
  const auto seed = GENERATE(range(1u, 21u));
  CAPTURE(seed);
  std::mt19937 random(seed);
  SpscRing<int, 8> ring;
  std::deque<int> model;
  uint64_t dropped = 0;
  for (int step = 0; step < 1000; ++step) {
    CAPTURE(step);
    // Runs of pushes and of pops, so that the ring is often full and often empty.
    const bool pushes = random() % 100 < (step / 50 % 2 == 0 ? 70 : 30);
    if (pushes) {
      const bool fits = model.size() < ring.capacity();
      REQUIRE(ring.push(step) == fits);
      if (fits) model.push_back(step);
      dropped += !fits;
    } else {
      int value = -1;
      REQUIRE(ring.pop(value) == !model.empty());
      REQUIRE(value == (model.empty() ? -1 : model.front()));
      if (!model.empty()) model.pop_front();
    }
    REQUIRE(ring.dropped() == dropped);
  }
  CHECK(dropped > 0);
}

}  // namespace tendril::rt::spsc_ring_test
