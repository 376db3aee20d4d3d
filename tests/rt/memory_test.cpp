// SPDX-License-Identifier: Apache-2.0
#include "rt/memory.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "rt/page_faults.h"
#include "rt/rt_error.h"
#include "tests/rt/child_process.h"

namespace tendril::rt::memory_test {

#ifndef TENDRIL_SANITIZED  // sanitizers ignore mlockall: their shadow memory is larger than any machine's

TEST_CASE("lock_memory says what to grant where it is refused", "[unit]") {
  const std::string message = in_child([]() -> std::string {
    const rlimit none{0, 0};
    if (setrlimit(RLIMIT_MEMLOCK, &none) != 0 || !give_up_root())
      return "could not give up the right to lock memory";
    try {
      lock_memory();
    } catch (const RtError& error) {
      return error.what();
    }
    return "locked";
  });
  CHECK_THAT(message, Catch::Contains("RLIMIT_MEMLOCK is 0 KiB"));
  for (const char* const remedy : {"CAP_IPC_LOCK", "LimitMEMLOCK=infinity", "limits.conf", "--allow-non-rt"})
    CHECK_THAT(message, Catch::Contains(remedy));
}

// Large enough for a mapping of its own, were that not turned off, and larger than what other tests left in
// the heap.
constexpr std::size_t kBytes = 64 << 20;

// Locks the memory of a child and runs the function there; skips the test where locking is not granted.
template <class Function>
void check_zero_with_locked_memory(Function function) {
  const std::string answer = in_child([&]() -> std::string {
    try {
      lock_memory();
      return std::to_string(function());
    } catch (const RtError& error) {
      return error.what();
    }
  });
  if (answer.starts_with("cannot lock memory"))
    WARN("skipped: " << answer);
  else
    CHECK(answer == "0");
}

int64_t faults_of_first_use(void* pages) {
  if (pages == nullptr || pages == MAP_FAILED) throw RtError("cannot lock memory as large as the test needs");
  const PageFaultCounter counter;
  std::memset(pages, 1, kBytes);
  asm volatile("" : : "r"(pages) : "memory");
  const PageFaults faults = counter.faults();
  return faults.minor + faults.major;
}

TEST_CASE("After lock_memory, new pages are there before their first use", "[rt]") {
  check_zero_with_locked_memory([] {
    return faults_of_first_use(
        mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
  });
}

TEST_CASE("After lock_memory, freed memory stays with the process and comes back without a fault", "[rt]") {
  check_zero_with_locked_memory([] {
    void* block = std::malloc(kBytes);
    faults_of_first_use(block);
    const char* const end_of_heap = static_cast<char*>(sbrk(0));
    std::free(block);
    const int64_t given_back = end_of_heap - static_cast<char*>(sbrk(0));
    const PageFaultCounter counter;
    block = std::malloc(kBytes);
    const int64_t faults = counter.faults().minor + faults_of_first_use(block);
    std::free(block);
    return given_back + faults;
  });
}

TEST_CASE("After lock_memory, threads allocate from the one heap that keeps what is freed", "[rt]") {
  check_zero_with_locked_memory([] {
    const char* const heap = static_cast<char*>(std::malloc(1));
    bool elsewhere = true;
    std::thread([&] {
      const char* const block = static_cast<char*>(std::malloc(1 << 20));
      elsewhere = block < heap || block >= static_cast<char*>(sbrk(0));
    }).join();
    return elsewhere;
  });
}

TEST_CASE("prefault_stack takes the page faults of the stack in advance", "[rt]") {
  const auto faults_after = [](std::size_t prefaulted) {
    return std::stoi(in_child([=] {
      prefault_stack(prefaulted);
      const PageFaultCounter faults;
      prefault_stack(1 << 20);
      return std::to_string(faults.faults().minor);
    }));
  };
  CHECK(faults_after(0) > 100);
  CHECK(faults_after((1 << 20) + 4096) == 0);
}

#endif

}  // namespace tendril::rt::memory_test
