// SPDX-License-Identifier: Apache-2.0
#include "rt/heap_guard.h"

#include <malloc.h>
#include <stdlib.h>
#include <string.h>

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <memory>
#include <thread>
#include <vector>

#include "rt/histogram.h"
#include "rt/page_faults.h"
#include "rt/periodic_clock.h"
#include "rt/spsc_ring.h"
#include "rt/thread.h"
#include "rt/triple_buffer.h"

namespace tendril::rt::heap_guard_test {

// The compiler may leave out an allocation that nobody looks at.
template <class T>
T* seen(T* block) {
  asm volatile("" : "+r"(block) : : "memory");
  return block;
}

#ifdef TENDRIL_SANITIZED

TEST_CASE("HeapGuard says that it does not count under a sanitizer", "[rt]") {
  const HeapGuard guard;
  delete seen(new int);
  CHECK_FALSE(HeapGuard::available());
  CHECK(guard.calls() == 0);
}

#else

TEST_CASE("HeapGuard counts each member of the malloc family", "[rt]") {
  REQUIRE(HeapGuard::available());
  std::vector<int64_t> counts(14);
  {
    const HeapGuard guard;
    std::size_t next = 0;
    const auto note = [&] { counts[next++] = guard.calls(); };
    void* block = seen(malloc(10));
    note();
    block = seen(realloc(block, 1000));
    note();
    block = seen(reallocarray(block, 10, 200));
    note();
    free(block);
    note();
    free(seen(calloc(3, 5)));
    note();
    free(seen(aligned_alloc(64, 128)));
    note();
    free(seen(memalign(32, 100)));
    note();
    block = nullptr;
    const int error = posix_memalign(&block, 4096, 10);
    free(seen(block));
    note();
    free(seen(valloc(10)));
    note();
    free(seen(pvalloc(10)));
    note();
    delete seen(new int);
    note();
    delete[] seen(new double[7]);
    note();
    free(seen(strdup("a call from inside the C library")));
    note();
    free(seen(static_cast<void*>(nullptr)));
    note();
    counts.push_back(error);
  }
  CHECK(counts == std::vector<int64_t>{1, 2, 3, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 22, 0});
}

TEST_CASE("HeapGuard counts the growth of a vector, and nothing where it does not grow", "[rt]") {
  std::vector<int> values(4);
  const HeapGuard guard;
  values.push_back(1);
  const int64_t grown = guard.calls();
  values.push_back(2);
  const int64_t fits = guard.calls();
  CHECK(grown == 2);  // the new block and the end of the old
  CHECK(fits == 2);
}

TEST_CASE("HeapGuard counts aligned new", "[rt]") {
  struct alignas(128) Wide {
    char bytes[128];
  };
  const HeapGuard guard;
  delete seen(new Wide);
  const int64_t calls = guard.calls();
  CHECK(calls == 2);
}

TEST_CASE("HeapGuard leaves out the calls of other threads", "[rt]") {
  std::atomic<int> stage{0};
  int64_t others = 0;
  std::thread other([&] {
    while (stage.load() != 1) std::this_thread::yield();
    const HeapGuard guard;
    for (int i = 0; i < 1000; ++i) free(seen(malloc(100)));
    others = guard.calls();
    stage.store(2);
  });
  const HeapGuard guard;
  stage.store(1);
  while (stage.load() != 2) std::this_thread::yield();
  const int64_t calls = guard.calls();
  other.join();
  CHECK(calls == 0);
  CHECK(others == 2000);
}

TEST_CASE("HeapGuards nest", "[rt]") {
  const HeapGuard outer;
  free(seen(malloc(1)));
  const HeapGuard inner;
  free(seen(malloc(1)));
  const int64_t of_inner = inner.calls(), of_outer = outer.calls();
  CHECK(of_inner == 2);
  CHECK(of_outer == 4);
}

TEST_CASE("The replaced malloc family keeps its promises at the edges", "[rt]") {
  void* block = seen(&block);
  void* const untouched = block;
  CHECK(posix_memalign(&block, 3, 10) == EINVAL);
  CHECK(posix_memalign(&block, 4, 10) == EINVAL);
  CHECK(posix_memalign(&block, 64, SIZE_MAX / 2) == ENOMEM);
  CHECK(block == untouched);
  errno = 0;
  volatile std::size_t many = SIZE_MAX / 2;
  CHECK(reallocarray(nullptr, many, 4) == nullptr);
  CHECK(errno == ENOMEM);
  void* const aligned = aligned_alloc(1024, 2048);
  CHECK(reinterpret_cast<std::uintptr_t>(aligned) % 1024 == 0);
  free(aligned);
}

TEST_CASE("What the control thread calls makes no heap call", "[rt]") {
  const auto channel = std::make_unique<TripleBuffer<std::array<double, 100>>>();
  const auto ring = std::make_unique<SpscRing<double, 16>>();
  const auto histogram = std::make_unique<Histogram>(), other = std::make_unique<Histogram>();
  PeriodicClock clock(100'000);
  const HeapGuard guard;
  const PageFaultCounter faults;
  double sink = 0;
  for (int i = 0; i < 100; ++i) {
    const int64_t intended_ns = clock.wait();
    histogram->record(now_ns() - intended_ns);
    channel->back()[0] = i;
    channel->publish();
    sink += channel->latest()[0];
    ring->push(sink);
    if (i % 2 == 0) ring->pop(sink);
    histogram->record_with_missed(i * 1'000'000, clock.period_ns());
    clock.realign(now_ns());
  }
  histogram->merge(*other);
  histogram->clear();
  sink += static_cast<double>(histogram->percentile_ns(99) + faults.faults().major) +
          scheduling_of_this_thread().priority;
  const int64_t calls = guard.calls();
  CHECK(calls == 0);
  CHECK(sink > 0);
}

#endif

}  // namespace tendril::rt::heap_guard_test
