// SPDX-License-Identifier: Apache-2.0
#include "rt/triple_buffer.h"

#include <catch2/catch.hpp>
#include <memory>
#include <random>
#include <vector>

#include "tests/rt/channel_fuzz.h"

namespace tendril::rt::triple_buffer_test {

// Broken on purpose: two slots, and nothing tells the writer which one the reader holds.
class TwoBuffers {
 public:
  TornValue& back() { return slots_[1 - latest_.load()]; }
  void publish() { latest_.store(1 - latest_.load()); }
  bool fresh() const { return false; }
  const TornValue& latest() { return slots_[latest_.load()]; }

 private:
  std::array<TornValue, 2> slots_;
  std::atomic<std::size_t> latest_{0};
};

// Broken on purpose: three slots, but the reader swaps whether there is something new or not.
class NoFreshBit {
 public:
  TornValue& back() { return slots_[back_]; }
  void publish() { back_ = middle_.exchange(back_); }
  bool fresh() const { return false; }
  const TornValue& latest() {
    front_ = middle_.exchange(front_);
    return slots_[front_];
  }

 private:
  std::array<TornValue, 3> slots_;
  std::atomic<std::size_t> middle_{1};
  std::size_t back_ = 0, front_ = 2;
};

TEST_CASE("TripleBuffer never hands out a torn, changed or older value, and always the last one", "[rt]") {
  const auto seed = GENERATE(1u, 2u, 3u, 4u);
  CAPTURE(seed);
  const LatestVerdict verdict = fuzz_latest<TripleBuffer<TornValue>>(50'000, seed);
  CHECK(verdict.torn == 0);
  CHECK(verdict.changed == 0);
  CHECK(verdict.older == 0);
  CHECK_FALSE(verdict.last_missed);
  CHECK(verdict.newer > 0);
}

#ifndef TENDRIL_UNDER_TSAN  // the twins race on purpose, for their own kinds under TSan see
                            // memory_order_test.cpp
TEST_CASE("The fuzz of TripleBuffer catches two buffers without a handshake", "[rt]") {
  CHECK(finds_out([](auto seed) { return fuzz_latest<TwoBuffers>(20'000, seed).torn > 0; }));
}

TEST_CASE("The fuzz of TripleBuffer catches three buffers without a fresh bit", "[rt]") {
  CHECK(finds_out([](auto seed) { return fuzz_latest<NoFreshBit>(20'000, seed).older > 0; }));
}
#endif

TEST_CASE("TripleBuffer keeps writer and reader in different slots at every step", "[unit]") {
  const auto seed = GENERATE(range(1u, 21u));
  CAPTURE(seed);
  std::mt19937 random(seed);
  TripleBuffer<int> buffer;
  const int* held = &buffer.latest();
  int held_value = *held, published = 0;
  bool ever_published = false, unseen = false;
  for (int step = 0; step < 1000; ++step) {
    CAPTURE(step);
    switch (random() % 3) {
      case 0:
        buffer.back() = -1;
        break;  // half-way through a fill
      case 1:
        buffer.back() = ++published;
        buffer.publish();
        ever_published = unseen = true;
        break;
      default:
        held = &buffer.latest();
        held_value = published;
        unseen = false;
    }
    REQUIRE(held != &buffer.back());
    REQUIRE(*held == held_value);
    REQUIRE(buffer.fresh() == unseen);
    REQUIRE(buffer.has_value() == ever_published);
  }
}

TEST_CASE("TripleBuffer says that nothing was published yet", "[unit]") {
  TripleBuffer<int> buffer;
  CHECK_FALSE(buffer.has_value());
  CHECK(buffer.latest() == 0);
  CHECK_FALSE(buffer.has_value());
  buffer.back() = 7;
  CHECK_FALSE(buffer.has_value());
  buffer.publish();
  CHECK(buffer.has_value());
  CHECK(buffer.latest() == 7);
  CHECK(buffer.has_value());
}

TEST_CASE("TripleBuffer carries values that cannot be copied", "[unit]") {
  TripleBuffer<std::unique_ptr<int>> buffer;
  buffer.back() = std::make_unique<int>(5);
  buffer.publish();
  CHECK(*buffer.latest() == 5);
}

}  // namespace tendril::rt::triple_buffer_test
